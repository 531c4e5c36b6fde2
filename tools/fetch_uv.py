"""Fetches the pinned uv from the configured package index. Standard library only.

    python3 tools/fetch_uv.py .tools/uv

Needs neither pip nor venv. Reads pip's and uv's settings (index, find-links, certificates,
proxies, credentials). Exit codes: 3 = out of reach, 4 = not what was pinned.
"""

import contextlib
import hashlib
import io
import json
import netrc
import os
import platform
import ssl
import subprocess
import sys
import time
import urllib.error
import urllib.request
import zipfile
from collections.abc import Iterator
from html.parser import HTMLParser
from http.client import HTTPException
from pathlib import Path
from urllib.parse import unquote, urljoin, urlsplit, urlunsplit
from urllib.response import addinfourl

from package_index_settings import Settings, index_settings

VERSION = "0.13.8"
PUBLIC_INDEX = "https://pypi.org/simple"
ACCEPT = "application/vnd.pypi.simple.v1+json, text/html;q=0.5"
ATTEMPTS = 3  # a busy mirror answers the second or third time
TROUBLE = (OSError, ValueError, HTTPException)  # what reading a page can raise
OUT_OF_REACH, NOT_AS_PINNED = 3, 4
ADVICE = "set PIP_INDEX_URL or UV_DEFAULT_INDEX to an index in reach, or PIP_CERT, or HTTPS_PROXY"

# Platform: wheel tags in order of preference, each with the SHA-256 of the wheel.
GNU_X86 = "manylinux_2_17_x86_64.manylinux2014_x86_64"
STATIC_X86 = "musllinux_1_1_x86_64"
STATIC_ARM = "manylinux_2_17_aarch64.manylinux2014_aarch64.musllinux_1_1_aarch64"
SHA256 = {
    GNU_X86: "e18a57b8b352eb7c8feb317b9f6f533c8f0ad9673fd6cf34bbe3cf1a9f6a8984",
    STATIC_X86: "29451c60f5e8b07403e0a175d5229efc36b0289b34143ff4aaa499a5dd52553a",
    STATIC_ARM: "0b3e8b1a4f5e405e31e2ff33de8af4744831e9f7338539671efbd8c3c94e791d",
    "macosx_10_12_x86_64": "b7124ca1956ec2e476a1003ea5715a15f0266afaec37f4dc9c6972ba8183e6d1",
    "macosx_11_0_arm64": "62b6943c7fd64fac6854f780bea6e0359e5a5bc3241f83ee357bb38276afac49",
}
TAGS = {
    "linux-x86_64-glibc": (GNU_X86, STATIC_X86),
    "linux-x86_64-musl": (STATIC_X86,),
    "linux-aarch64-glibc": (STATIC_ARM,),
    "linux-aarch64-musl": (STATIC_ARM,),
    "darwin-x86_64": ("macosx_10_12_x86_64",),
    "darwin-arm64": ("macosx_11_0_arm64",),
}


class UnavailableError(Exception):
    """The pinned wheel cannot be had; carries the exit code."""

    def __init__(self, message: str, code: int = OUT_OF_REACH) -> None:
        super().__init__(message)
        self.code = code


def fetch_uv(target: Path, settings: Settings) -> None:
    """Put the pinned uv at `target` unless it is there already."""
    if version_at(target) == VERSION:
        return
    wheels = {f"uv-{VERSION}-py3-none-{tag}.whl": SHA256[tag] for tag in tags_of_this_machine()}
    name, url = locate(wheels, settings)
    content = download(url, settings)
    if (found := hashlib.sha256(content).hexdigest()) != wheels[name]:
        message = f"{redacted(url)} has SHA-256 {found} instead of the pinned {wheels[name]}"
        raise UnavailableError(message, NOT_AS_PINNED)
    unpack(content, target)


def version_at(program: Path) -> str | None:
    """The version of the uv at a path; None where there is none that runs."""
    try:
        answer = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return answer.stdout.split()[1]


def tags_of_this_machine() -> tuple[str, ...]:
    """The wheel tags that run here, best first."""
    machine = platform.machine().lower()
    name = f"{sys.platform}-{machine}"
    if sys.platform == "linux":
        machine = {"arm64": "aarch64", "amd64": "x86_64"}.get(machine, machine)
        name = f"linux-{machine}-{'glibc' if platform.libc_ver()[0] == 'glibc' else 'musl'}"
    if name not in TAGS:
        raise UnavailableError(f"no uv is pinned for {name}: put uv {VERSION} at .tools/uv")
    return TAGS[name]


def locate(wheels: dict[str, str], settings: Settings) -> tuple[str, str]:
    """The best wheel that any configured place offers: its name and URL."""
    offered: dict[str, str] = {}
    troubles: list[str] = []
    for place in places(settings):
        try:
            found = {name: like(place, url) for name, url in links_at(place, settings)}
            offered = found | offered
        except TROUBLE as error:
            troubles.append(f"{redacted(place)} ({reason(error)})")
            continue
        if next(iter(wheels)) in offered:
            break
    for name in wheels:
        if name in offered:
            return name, offered[name]
    if troubles:
        raise UnavailableError("cannot read " + ", ".join(troubles))
    raise UnavailableError("no configured index has " + " or ".join(wheels))


def places(settings: Settings) -> Iterator[str]:
    """Where to look, in order: find-links, then the indexes."""
    yield from filter(None, settings.get("UV_FIND_LINKS", "").split(","))
    if settings.get("UV_NO_INDEX"):
        return
    extra = settings.get("UV_INDEX", "").split()
    for index in (*extra, settings.get("UV_DEFAULT_INDEX", PUBLIC_INDEX)):
        name, equals, url = index.partition("=")  # uv writes name=url
        yield (url if equals and "/" not in name else index).rstrip("/") + "/uv/"


def links_at(place: str, settings: Settings) -> Iterator[tuple[str, str]]:
    """The files offered at a folder, a file or a page: name and URL of each."""
    local = Path(place if "://" not in place else unquote(urlsplit(place).path))
    if "://" not in place or place.startswith("file:"):
        if local.is_dir() and not (local / "index.html").is_file():
            yield from ((path.name, path.resolve().as_uri()) for path in local.iterdir())
            return
        page = local / "index.html" if local.is_dir() else local
        place = page.resolve().as_uri()
    if place.endswith(".whl"):
        yield Path(place).name, place
        return
    with open_url(place, settings) as answer:
        text, url = answer.read().decode(), answer.geturl()
    if text.lstrip().startswith("{"):
        for file in json.loads(text)["files"]:
            yield file["filename"], urljoin(url, file["url"])
    else:
        yield from Anchors(url, text).links


class Anchors(HTMLParser):
    """The links of a page in the form of PEP 503."""

    def __init__(self, url: str, text: str) -> None:
        super().__init__()
        self.base = url
        self.links: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take note of a link, or of the page's base."""
        target = dict(attrs).get("href")
        if target and tag == "base":
            self.base = urljoin(self.base, target)
        elif target and tag == "a":
            url = urljoin(self.base, target)
            self.links.append((unquote(urlsplit(url).path).rpartition("/")[2], url))


def download(url: str, settings: Settings) -> bytes:
    """The content at a URL."""
    try:
        with open_url(url, settings) as answer:
            return answer.read()
    except TROUBLE as error:
        raise UnavailableError(f"cannot read {redacted(url)} ({reason(error)})") from error


def open_url(url: str, settings: Settings) -> addinfourl:
    """Open a URL with the user's certificates, proxies and credentials; try again if it is busy."""
    request = urllib.request.Request(redacted(url), headers={"Accept": ACCEPT})
    opener, timeout = opener_for(url, settings), float(settings.get("UV_HTTP_TIMEOUT", "30"))
    for attempt in range(1, ATTEMPTS + 1):
        try:
            answer: addinfourl = opener.open(request, timeout=timeout)
            return answer
        except OSError as error:
            hopeless = isinstance(error, urllib.error.HTTPError) and error.code < 500
            if hopeless or attempt == ATTEMPTS:
                raise
            time.sleep(attempt)
    raise AssertionError


def opener_for(url: str, settings: Settings) -> urllib.request.OpenerDirector:
    """An opener that knows the credentials for the URL's host; they are not sent elsewhere."""
    passwords = urllib.request.HTTPPasswordMgrWithPriorAuth()
    if known := credentials(url):
        parts = urlsplit(redacted(url))
        origin = urlunsplit((parts.scheme, parts.netloc, "/", "", ""))
        passwords.add_password(None, origin, *known, is_authenticated=True)
    proxies = urllib.request.getproxies()
    if everything := settings.get("ALL_PROXY") or proxies.get("all"):
        proxies = {"http": everything, "https": everything} | proxies
    return urllib.request.build_opener(
        urllib.request.ProxyHandler(proxies),
        urllib.request.HTTPSHandler(context=tls_context(url, settings)),
        urllib.request.HTTPBasicAuthHandler(passwords),
    )


def credentials(url: str) -> tuple[str, str] | None:
    """User and password from the URL, else from netrc."""
    parts = urlsplit(url)
    if parts.username is not None:
        return unquote(parts.username), unquote(parts.password or "")
    path = Path(os.environ.get("NETRC") or os.path.expanduser("~/.netrc"))
    with contextlib.suppress(OSError, netrc.NetrcParseError):  # pip, too, passes over a bad one
        if entry := netrc.netrc(path).authenticators(parts.hostname or ""):
            return entry[0], entry[2] or ""
    return None


def tls_context(url: str, settings: Settings) -> ssl.SSLContext:
    """The certificates to trust: the configured ones, the machine's, or else pip's own list."""
    parts = urlsplit(redacted(url))
    if {parts.netloc, parts.hostname} & set(settings.get("UV_INSECURE_HOST", "").split()):
        return ssl._create_unverified_context()  # the content is checked against its SHA-256
    bundle, folder = settings.get("SSL_CERT_FILE"), settings.get("SSL_CERT_DIR")
    context = ssl.create_default_context(cafile=bundle, capath=folder)
    if client := settings.get("SSL_CLIENT_CERT"):
        context.load_cert_chain(client)
    if not (bundle or folder or settings.get("UV_SYSTEM_CERTS") or os.environ.get("SSL_CERT_DIR")):
        try:
            from pip._vendor import certifi
        except ImportError:
            return context
        context.load_verify_locations(certifi.where())
    return context


def unpack(wheel: bytes, target: Path) -> None:
    """Write the program to `target` in one step, so that nobody sees half of it."""
    with zipfile.ZipFile(io.BytesIO(wheel)) as archive:
        program = archive.read(f"uv-{VERSION}.data/scripts/uv")
    target.parent.mkdir(parents=True, exist_ok=True)
    draft = target.with_name(f"{target.name}.{os.getpid()}")
    draft.write_bytes(program)
    draft.chmod(0o755)
    draft.replace(target)


def redacted(url: str) -> str:
    """A URL without credentials."""
    parts = urlsplit(url)
    return urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2], fragment=""))


def like(place: str, url: str) -> str:
    """A URL found at a place, with the credentials of the place if both are on one host."""
    there, here = urlsplit(redacted(place)), urlsplit(url)
    if (there.scheme, there.netloc) != (here.scheme, here.netloc):
        return url
    return urlunsplit(here._replace(netloc=urlsplit(place).netloc))


def reason(error: Exception) -> str:
    """What went wrong, in one line."""
    if isinstance(error, urllib.error.HTTPError):
        return str(error)
    return str(getattr(error, "reason", None) or error)


def main(target: str) -> int:
    """Fetch uv; report trouble in one line."""
    try:
        fetch_uv(Path(target), index_settings(os.environ))
    except UnavailableError as error:
        advice = f"; {ADVICE}" if error.code == OUT_OF_REACH else ""
        print(f"cannot fetch uv {VERSION}: {error}{advice}", file=sys.stderr)
        return error.code
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
