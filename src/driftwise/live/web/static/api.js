// The OpenAPI document as a table.
import { element } from "./words.js";

const { paths } = await (await fetch("openapi.json")).json();
for (const [path, methods] of Object.entries(paths)) {
  for (const [method, { summary, parameters, requestBody }] of Object.entries(methods)) {
    const query = parameters.filter((one) => one.in === "query").map(({ name, description }) => `${name}: ${description}`);
    const bodies = Object.entries(requestBody?.content ?? {}).map(([media, { example }]) => `${media}: ${example}`);
    document.getElementById("routes").append(element("tr", {}, element("td", {}, element("code", {}, `${method.toUpperCase()} ${path}`)),
      element("td", {}, summary), element("td", {}, ...[...query, ...bodies].map((text) => element("div", {}, text)))));
  }
}
