"""Package index settings: what the user told pip or uv, as the environment variables that uv reads.

Highest first: uv's variables, uv.toml, pip's variables, pip's configuration files.
Standard library only. Run as a program it prints `export NAME='value'` lines for a shell.
"""

import configparser
import os
import shlex
import ssl
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

Settings = dict[str, str]

# pip's option, uv's variable (uv itself has only an option for UV_NO_INDEX: tools/create_venv.py).
PIP_OPTIONS = {
    "index-url": "UV_DEFAULT_INDEX",
    "extra-index-url": "UV_INDEX",
    "find-links": "UV_FIND_LINKS",
    "no-index": "UV_NO_INDEX",
    "trusted-host": "UV_INSECURE_HOST",
    "cert": "SSL_CERT_FILE",
    "client-cert": "SSL_CLIENT_CERT",
    "proxy": "ALL_PROXY",
    "default-timeout": "UV_HTTP_TIMEOUT",
    "timeout": "UV_HTTP_TIMEOUT",
}
OLDER_NAMES = {"UV_INDEX_URL": "UV_DEFAULT_INDEX", "UV_EXTRA_INDEX_URL": "UV_INDEX"}
CERTIFICATES_OF_REQUESTS = ("CURL_CA_BUNDLE", "REQUESTS_CA_BUNDLE")  # pip's HTTP library
TRUE_WORDS = ("1", "true", "yes", "on", "y", "t")


def index_settings(environ: Mapping[str, str]) -> Settings:
    """uv's variables with every setting of the user filled in: the whole truth for a download."""
    found = from_pip(environ) | from_uv_files(environ) | from_uv_variables(environ)
    return with_certificates(checked(found), environ)


def from_uv_variables(environ: Mapping[str, str]) -> Settings:
    """The settings given in uv's own variables."""
    older = {name: environ[old] for old, name in OLDER_NAMES.items() if environ.get(old)}
    return older | {name: environ[name] for name in PIP_OPTIONS.values() if environ.get(name)}


def from_uv_files(environ: Mapping[str, str]) -> Settings:
    """The settings given in uv.toml, the user's over the system's."""
    found: Settings = {}
    for path in uv_files(environ):
        if path.is_file():
            table = read_toml(path)
            found |= from_uv_table(table) | from_uv_table(table.get("pip", {}))
    return found


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file; ends the program if it is not one."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        sys.exit(f"{path}: {error}")


def uv_files(environ: Mapping[str, str]) -> Iterator[Path]:
    """The places of uv.toml, lowest first."""
    if environ.get("UV_NO_CONFIG", "").lower() in TRUE_WORDS:
        return
    if environ.get("UV_CONFIG_FILE"):
        yield Path(environ["UV_CONFIG_FILE"])
        return
    yield Path("/etc/uv/uv.toml")
    yield user_config(environ) / "uv" / "uv.toml"


def from_uv_table(table: Mapping[str, Any]) -> Settings:
    """The settings of one table of uv.toml."""
    found: Settings = {}
    if "index-url" in table:
        found["UV_DEFAULT_INDEX"] = table["index-url"]
    extra = list(table.get("extra-index-url", []))
    for index in table.get("index", []):
        if index.get("default"):
            found["UV_DEFAULT_INDEX"] = index["url"]
        elif not index.get("explicit"):
            extra.append(index["url"])
    lists = {
        "UV_INDEX": " ".join(extra),
        "UV_FIND_LINKS": ",".join(table.get("find-links", [])),
        "UV_INSECURE_HOST": " ".join(table.get("allow-insecure-host", [])),
        "UV_NO_INDEX": "1" if table.get("no-index") else "",
    }
    return found | {name: value for name, value in lists.items() if value}


def from_pip(environ: Mapping[str, str]) -> Settings:
    """The settings given to pip, under uv's names."""
    options: dict[str, str] = {}
    for name in CERTIFICATES_OF_REQUESTS:
        if environ.get(name):
            options["cert"] = environ[name]
    for path in pip_files(environ):
        options |= pip_file_options(path)
    for option in PIP_OPTIONS:
        value = environ.get("PIP_" + option.upper().replace("-", "_"))
        if value:
            options[option] = value
    return {
        PIP_OPTIONS[option]: translated
        for option, value in options.items()
        if option in PIP_OPTIONS and (translated := in_the_words_of_uv(option, value))
    }


def pip_files(environ: Mapping[str, str]) -> Iterator[Path]:
    """The places of pip's configuration, lowest first, as pip reads them."""
    given = environ.get("PIP_CONFIG_FILE", "")
    if given == os.devnull:
        return
    mac = Path("Library/Application Support/pip/pip.conf")
    if sys.platform == "darwin":
        yield Path("/") / mac
    for folder in reversed(environ.get("XDG_CONFIG_DIRS", "/etc/xdg").split(os.pathsep)):
        yield Path(folder) / "pip" / "pip.conf"
    yield Path("/etc/pip.conf")
    if not (given and Path(given).exists()):
        yield home(environ) / ".pip" / "pip.conf"
        yield user_config(environ) / "pip" / "pip.conf"
        if sys.platform == "darwin":
            yield home(environ) / mac
    yield Path(sys.prefix) / "pip.conf"
    if given:
        yield Path(given)


def pip_file_options(path: Path) -> dict[str, str]:
    """The options of one file of pip: those of its commands over the global ones."""
    if not path.is_file():
        return {}
    parser = configparser.RawConfigParser()
    try:
        parser.read(path, encoding="utf-8")
    except (configparser.Error, ValueError) as error:
        sys.exit(f"{path}: {error}")
    options: dict[str, str] = {}
    for section in ("global", "install"):
        for name, value in parser.items(section) if parser.has_section(section) else ():
            options[name.removeprefix("--").replace("_", "-")] = value
    return options


def in_the_words_of_uv(option: str, value: str) -> str:
    """A value of pip as uv spells it; pip separates lists by white space."""
    words = value.split()
    if option in ("index-url", "extra-index-url"):
        return " ".join(as_url(word) for word in words)
    if option == "find-links":
        return ",".join(words)
    if option == "no-index":
        return "1" if value.lower() in TRUE_WORDS else ""
    if option in ("timeout", "default-timeout"):
        return str(int(float(value)))
    return " ".join(words) if option == "trusted-host" else value


def as_url(place: str) -> str:
    """A folder as a file URL; a URL as it is."""
    return Path(place).resolve().as_uri() if "://" not in place and Path(place).is_dir() else place


def checked(settings: Settings) -> Settings:
    """Without the places that do not exist: pip warns about these where uv gives up."""
    links = settings.get("UV_FIND_LINKS", "").split(",")
    there = [link for link in map(os.path.expanduser, links) if link and exists(link)]
    kept = {name: value for name, value in settings.items() if name != "UV_FIND_LINKS"}
    if there:
        kept["UV_FIND_LINKS"] = ",".join(there)
    if not exists(kept.get("SSL_CERT_FILE", os.devnull)):
        del kept["SSL_CERT_FILE"]
    return kept


def exists(place: str) -> bool:
    """Whether a file or folder is there (a URL counts as there); says so if not."""
    if "://" in place or Path(place).exists():
        return True
    print(f"warning: ignoring {place}, which does not exist", file=sys.stderr)
    return False


def with_certificates(settings: Settings, environ: Mapping[str, str]) -> Settings:
    """With the machine's own certificates unless the user chose some: uv brings its own list."""
    bundle = settings.get("SSL_CERT_FILE")
    if bundle and Path(bundle).is_dir():
        settings = {name: value for name, value in settings.items() if name != "SSL_CERT_FILE"}
        return settings | {"SSL_CERT_DIR": bundle}
    chosen = ("SSL_CERT_DIR", "UV_SYSTEM_CERTS", "UV_NATIVE_TLS")
    if bundle or any(environ.get(name) for name in chosen) or not has_system_certificates():
        return settings
    return settings | {"UV_SYSTEM_CERTS": "1"}


def has_system_certificates() -> bool:
    """Whether this Python finds certificate authorities on the machine."""
    paths = ssl.get_default_verify_paths()
    return bool(paths.cafile or (paths.capath and os.listdir(paths.capath)))


def home(environ: Mapping[str, str]) -> Path:
    """The home folder, also where HOME is unset or empty."""
    return Path(environ.get("HOME") or os.path.expanduser("~"))


def user_config(environ: Mapping[str, str]) -> Path:
    """The folder of the user's configuration."""
    return Path(environ.get("XDG_CONFIG_HOME") or home(environ) / ".config")


if __name__ == "__main__":
    for name, value in sorted(index_settings(os.environ).items()):
        print(f"export {name}={shlex.quote(value)}")
