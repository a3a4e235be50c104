"""The service with its page: samples in by HTTP, the same numbers out."""

import json
import ssl
import subprocess
import urllib.error
import urllib.request
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from live_plant import found as kept
from live_plant import lines, opened, outputs, states
from live_process import ended, started

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
pytest.importorskip("sse_starlette")
pytest.importorskip("prometheus_client")

from driftwise.live.web.access import hashed, new_token


def asked(address, data=None):
    kind = {"Content-Type": "application/x-ndjson", "X-Driftwise": "1"} if data else {}
    with urllib.request.urlopen(urllib.request.Request(address, data, kind), timeout=60) as answer:
        return json.loads(answer.read())


def test_samples_by_http_are_estimated_and_told(tmp_path):
    y = outputs(5, 300)
    path = tmp_path / "live.toml"
    path.write_text(f'[model]\nmodel = "ar:2"\n[store]\npath = "{tmp_path / "store"}"\n[web]\nport = 0\n')
    service = started(path, stderr=subprocess.PIPE)
    try:
        address = service.stderr.readline().split()[-1]
        for at in range(0, 300, 50):
            told = asked(f"{address}/samples", lines(y, at, at + 50).encode())
            assert told == {"taken": 250, "refused": 0, "reason": ""}
        series = asked(f"{address}/api/series")["series"]
        assert [one["key"] for one in series] == [f"s{i}" for i in range(5)]
        one = asked(f"{address}/api/series/s3")
        assert one["count"] == 300
        assert one["output"] == pytest.approx(y[3, -1], rel=1e-12)
        assert len(one["parameters"]) == 3
        past = asked(f"{address}/api/series/s3/history")
        assert past["output"] == pytest.approx(y[3].tolist(), rel=1e-12)
        assert asked(f"{address}/health")["healthy"]
    finally:
        assert ended(service) == 0
        service.stderr.close()
    assert kept(opened(tmp_path / "store")) == states(y)


def test_beyond_this_machine_there_is_tls_and_a_token(tmp_path):
    token = new_token()
    certificate, key = self_signed(tmp_path)
    path = tmp_path / "live.toml"
    path.write_text(
        f'[model]\nmodel = "arx:1,1"\ninputs = ["u"]\n[store]\npath = "{tmp_path / "store"}"\n'
        f'[web]\nport = 0\nhost = "0.0.0.0"\ntoken_hash = "{hashed(token)}"\n'
        f'tls_cert = "{certificate}"\ntls_key = "{key}"\n'
    )
    service = started(path, stderr=subprocess.PIPE)
    trusted = ssl.create_default_context(cafile=str(certificate))

    def ask(place, data=None, scheme="https", context=trusted, **headers):
        wanted = urllib.request.Request(f"{scheme}://localhost:{port}{place}", data, headers)
        with urllib.request.urlopen(wanted, timeout=60, context=context if scheme == "https" else None) as answer:
            return json.loads(answer.read())

    try:
        address = service.stderr.readline().split()[-1]
        port = int(address.rpartition(":")[2])
        assert address.startswith("https://")
        rng = np.random.default_rng(1)
        u, y = rng.standard_normal(300), np.zeros(300)
        for t in range(1, 300):
            y[t] = 0.5 * y[t - 1] + u[t - 1] + 0.01 * rng.standard_normal()
        u[-1] = 2.0
        body = "".join(json.dumps({"key": "p", "time": 1e9 + t, "value": y[t], "u": u[t]}) + "\n" for t in range(300))
        bearer = {"Authorization": f"Bearer {token}", "Content-Type": "application/x-ndjson", "X-Driftwise": "1"}
        assert ask("/samples", body.encode(), **bearer)["taken"] == 300
        ahead = ask("/api/series/p", **bearer)["ahead"]
        assert ahead[-1][0] == pytest.approx(4.0, abs=0.2)  # u / (1 - a): the inputs are held
        for wrong in ({}, {"Authorization": "Bearer no"}):
            with pytest.raises(urllib.error.HTTPError, match="401"):
                ask("/api/series", **wrong)
        with pytest.raises(urllib.error.URLError, match="certificate verify failed"):
            ask("/api/series", context=ssl.create_default_context(), **bearer)
        with pytest.raises((urllib.error.URLError, OSError)):
            ask("/api/series", scheme="http", **bearer)
    finally:
        assert ended(service) == 0
        service.stderr.close()


def self_signed(folder):
    """Write a certificate for this machine and its key; return both files."""
    x509 = pytest.importorskip("cryptography.x509", reason="cryptography is not installed")
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    name, now = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")]), datetime.now(UTC)
    builder = x509.CertificateBuilder(name, name, key.public_key(), x509.random_serial_number(), now,
                                      now + timedelta(1))  # fmt: skip
    names = x509.SubjectAlternativeName([x509.DNSName("localhost")])
    certificate = builder.add_extension(names, critical=False).sign(key, hashes.SHA256())
    files = folder / "cert.pem", folder / "key.pem"
    files[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    files[1].write_bytes(
        key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
    return files
