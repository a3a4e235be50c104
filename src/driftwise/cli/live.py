"""`driftwise live`: from the sensor bus to the alarm, for months."""

from __future__ import annotations

import signal
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from driftwise.cli import specs
from driftwise.cli.options import Inputs
from driftwise.engine.errors import CommandError, InputError

CONFIG = "driftwise-live.toml"


@dataclass
class LiveJob:
    """Estimate series as they come, keep their states through everything, and tell what happens to them.

    WHAT is a configuration (live.toml), - for lines on standard input, an address with topics
    (mqtt://host/plant/+/flow), demo to see it at work on simulated pumps, init to write a commented example, status to
    ask a store how it is, or token for a token that lets others than this machine look at the page.

    Example: driftwise live live.toml --check
    """

    what: Annotated[str, typer.Argument(metavar="WHAT", help="FILE.toml, -, mqtt://.., demo, init, status or token.")]
    path: Annotated[
        str | None, typer.Argument(metavar="[PATH]", help="init: the file to write. status: FILE.toml, or a folder.")
    ] = None
    only_check: Annotated[
        bool, typer.Option("--check", metavar="", help="Check the configuration, say what will happen, and stop.")
    ] = False
    model: Annotated[
        str | None, typer.Option(metavar="KIND:ORDERS", help="As for run; auto: the first samples choose it.")
    ] = None
    memory: Annotated[str | None, typer.Option(metavar="KIND:NUMBER", help="As for run; auto if omitted.")] = None
    output: Annotated[str | None, typer.Option("--output", "-o", metavar="FIELD", help="Field of the output.")] = None
    input: Inputs = None
    store: Annotated[str | None, typer.Option(metavar="DIR", help="Folder of states and history.")] = None
    port: Annotated[int | None, typer.Option(metavar="PORT", min=0, help="Where the page is served.")] = None
    web: Annotated[bool, typer.Option("--web/--no-web", help="Serve page and API, or do not.")] = True
    log: Annotated[str, typer.Option(metavar="text|json", help="How events are printed.")] = "text"

    def run(self) -> None:
        """Write an example, ask a store, check, or run."""
        import asyncio  # here and below: no other command has to wait for it

        if self.what == "init":
            self._init(Path(self.path or CONFIG))
        elif self.what == "status":
            self._status()
        elif self.what == "demo":
            self._demo()
        elif self.what == "token":
            self._token()
        else:
            config = self.config()
            self._plan(config) if self.only_check else asyncio.run(self._serve(config))

    # --- what is asked for ---------------------------------------------------------------------------------

    def config(self) -> Any:
        """Return the configuration of file, environment and flags."""
        from driftwise.live.config import load

        if self.log not in ("text", "json"):
            raise CommandError(f"--log is text or json, got {self.log!r}.")
        found = self._short() if self.what == "-" or self.what.startswith(("mqtt://", "mqtts://")) else load(self.what)
        flags = dict(model=self.model, memory=self.memory, output=self.output,
                     inputs=tuple(self.input) if self.input else None)  # fmt: skip
        model = replace(found.model, **{name: value for name, value in flags.items() if value is not None})
        web = replace(found.web, **({} if self.port is None else {"port": self.port}))
        web = web if self.web else replace(web, enabled=False)
        store = found.store if self.store is None else replace(found.store, path=self.store)
        found = replace(found, model=model, web=web, store=store)
        for one in (found.model, *found.series):
            if one.model != "auto":
                estimator_of(one)
        if not found.sources and not found.web.enabled:
            raise CommandError(f"{self.what} names no [[source]], and nothing is served: no sample can ever come.")
        return found

    def _short(self) -> Any:
        """Return the configuration of one line: standard input, or a topic."""
        from driftwise.live.config import Config, StoreConfig, WebConfig
        from driftwise.live.outputs.log import LogOutput
        from driftwise.live.sources.files import StdinSource
        from driftwise.live.sources.mqtt import MqttSource

        shown = (LogOutput(format=self.log),)
        if self.what == "-":
            return Config((StdinSource(),), store=StoreConfig(), outputs=shown, web=WebConfig(enabled=False))
        scheme, _, rest = self.what.partition("://")
        host, _, topic = rest.partition("/")
        source = MqttSource(f"{scheme}://{host}", (topic or "#",))
        return Config((source,), store=StoreConfig(), outputs=shown)

    def _plan(self, config: Any) -> None:
        """Say what will happen."""
        from driftwise.report.printed import say

        for source in config.sources:
            say(source.plan())
        say(f"{config.model.model} with {config.model.memory} memory on every series")
        for one in config.series:
            say(f"{one.model} with {one.memory} memory on series {one.keys}")
        say(
            f"states and history in {config.store.url or config.store.path}, on the disk every {config.store.fsync:g} s"
        )
        for output in config.outputs:
            say(output.plan())
        if config.web.enabled:
            access = "with a token" if config.web.token_hash else "for this machine alone"
            say(f"page and API at {config.web.host}, port {config.web.port}, {access}")

    # --- at work -------------------------------------------------------------------------------------------

    async def _serve(self, config: Any, site: Any = None) -> None:
        """Run until asked to end; asked to reload (SIGHUP), read the configuration again and go on."""
        import asyncio

        from driftwise.live.service import Service
        from driftwise.report.printed import say
        from driftwise.results.numbers import often

        configs, services = [config], list[Service]()

        def end() -> None:
            configs.clear()
            for service in services:
                service.stop()

        def reload() -> None:
            try:
                configs.append(self.config())
                for service in services:
                    service.stop()
            except InputError as error:
                say(f"the configuration stays as it is: {error}", stderr=True)

        loop = asyncio.get_running_loop()
        with suppress(NotImplementedError):  # Windows
            for number in (signal.SIGTERM, signal.SIGINT):
                loop.add_signal_handler(number, end)
            loop.add_signal_handler(signal.SIGHUP, reload)
        while configs:
            config = configs.pop()
            configs.clear()
            services[:] = [Service(config, estimator_of, site or self._site(config))]
            await services[0].run()
            for reason, count in services[0].core.reasons.items():
                say(f"not used, {often(count)}: {reason}", stderr=True)

    def _site(self, config: Any) -> Any:
        """Return what makes the page of a board and says where it is; None where none is wanted."""
        from driftwise.report.printed import say

        if not config.web.enabled:
            return None
        try:
            from driftwise.live.web.serve import site_of
        except ModuleNotFoundError as error:
            words = f'the page needs {error.name}: pip install "driftwise[live]", or --no-web.'
            raise CommandError(words) from None

        return lambda board: site_of(board, config.web, lambda address: say(f"the page is at {address}", stderr=True))

    # --- beside it -----------------------------------------------------------------------------------------

    def _demo(self) -> None:
        """Run a plant of pumps, the service and its page; forget all of it at the end."""
        import asyncio
        from tempfile import TemporaryDirectory

        from driftwise.live import demo
        from driftwise.live.config import WebConfig
        from driftwise.report.printed import say

        wanted = WebConfig().port if self.port is None else self.port
        web = WebConfig(port=demo.free_port(wanted))
        with TemporaryDirectory(prefix="driftwise-demo-") as folder, demo.broker() as port:
            config = demo.configuration(port, Path(folder), web)
            site = self._site(config)
            way = f"through {demo.BROKER} at port {port}" if port else f"handed over ({demo.BROKER} is not installed)"
            say(f"{demo.PUMPS} pumps, ten samples a second of each, {way}; Ctrl-C ends it.")
            say(f"The bearing of pump {demo.FAILING:02d} fails after a minute.")
            asyncio.run(self._serve(config, lambda board: demo.Fed(site(board), board, port)))

    def _init(self, path: Path) -> None:
        """Write a commented example."""
        from importlib.resources import files

        from driftwise.report.printed import say

        if path.exists():
            raise CommandError(f"{path} is there already; another name: driftwise live init NAME.toml")
        path.write_text(files("driftwise.live").joinpath("example.toml").read_text("utf-8"), "utf-8")
        say(f"{path} written; look at it, then: driftwise live {path} --check")

    def _token(self) -> None:
        """Print a new token, and the line of the configuration that knows it again."""
        from driftwise.live.web.access import hashed, new_token
        from driftwise.report.printed import say

        token = new_token()
        say(f"token, for browsers and programs; it is written nowhere else: {token}")
        say(f'[web]\ntoken_hash = "{hashed(token)}"')

    def _status(self) -> None:
        """Say what a store holds; the service may run."""
        from driftwise.live.store import counted
        from driftwise.report.printed import say

        for words in counted(self._asked()):
            say(words)

    def _asked(self) -> Any:
        """Return the store that `status` asks about: of a configuration, or in a folder."""
        from driftwise.live.config import StoreConfig, load
        from driftwise.live.store.sqlite import NAME

        if self.path is None:
            return StoreConfig(path=self.store or StoreConfig().path)
        here = Path(self.path)
        if here.name == NAME:
            return StoreConfig(path=str(here.parent))
        if not here.is_dir():
            return load(here).store
        for folder in (here, here / StoreConfig().path):
            if (folder / NAME).exists():
                return StoreConfig(path=str(folder))
        if (here / CONFIG).exists():
            return load(here / CONFIG).store
        raise CommandError(f"{here} holds neither a store ({NAME}) nor a configuration ({CONFIG}): where is one?")


def estimator_of(config: Any) -> Any:
    """Return the estimator of a `ModelConfig`, as `fleet run` has it: with an offset besides."""
    dt = config.dt or 1.0
    try:
        if config.model.partition(":")[0] == "joint":
            text = config.model if config.memory == "auto" else f"{config.model}@{config.memory}"
            return specs.estimators([text], config.inputs, dt)[text]
        memory = "constant" if config.jumps and config.memory == "auto" else config.memory
        more = {} if config.model == "regression" else {"offset": True}
        return specs.recursive(config.model, config.inputs, memory=specs.policy(memory, config.jumps), dt=dt, **more)
    except InputError as error:
        raise CommandError(f"model = {config.model!r}, memory = {config.memory!r}: {error}") from None
