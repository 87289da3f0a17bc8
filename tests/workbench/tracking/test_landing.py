"""The bare address of the tracking server leads to the fits, and no other answer is touched."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import pytest

from sysid.workbench.tracking.landing import SETTINGS, leading_to, with_lead
from sysid.workbench.tracking.mlflow_views import TAG, VIEW

PAGE = b"<!doctype html><html><head><title>MLflow</title></head><body></body></html>"


async def server(scope, receive, send):
    """Sends a page in two parts, as a server does with a file."""
    sent = PAGE if scope["path"] == "/" else b"<head>a picture"
    headers = [(b"content-length", str(len(sent)).encode()), (b"etag", b"1"), (b"x-frame-options", b"DENY")]
    await send({"type": "http.response.start", "status": 200, "headers": headers})
    await send({"type": "http.response.body", "body": sent[:20], "more_body": True})
    await send({"type": "http.response.body", "body": sent[20:], "more_body": False})


def asked(path, *, method="GET", page="#/experiments/1"):
    """Status, headers and body of an answer."""
    sent = []

    async def send(message):
        sent.append(message)

    scope = {"type": "http", "method": method, "path": path, "headers": [(b"if-none-match", b"1")]}
    with ThreadPoolExecutor(1) as pool:  # a thread of its own: the browser tests leave a loop running in this one
        pool.submit(asyncio.run, leading_to(server, page)(scope, None, send)).result()
    return dict(sent[0]["headers"]), b"".join(message.get("body", b"") for message in sent[1:])


def test_the_bare_address_leads_to_the_page_with_a_length_that_is_right():
    headers, body = asked("/")
    assert body == with_lead(PAGE, "#/experiments/1")
    assert b'location.hash = "#/experiments/1"' in body
    assert headers[b"content-length"] == str(len(body)).encode()
    assert headers[b"x-frame-options"] == b"DENY"
    assert b"etag" not in headers


@pytest.mark.parametrize(
    ("path", "method", "page"),
    [("/static/a.png", "GET", "#/a"), ("/", "POST", "#/a"), ("/", "GET", "")],
    ids=["another path", "another method", "no page to lead to"],
)
def test_other_answers_are_left_alone(path, method, page):
    headers, body = asked(path, method=method, page=page)
    assert b"script" not in body
    assert headers[b"etag"] == b"1"


def test_the_page_is_given_what_its_scripts_do():
    text = with_lead(PAGE, "#/a").decode()
    assert "#/compare-runs" in text
    assert f'"{TAG.removesuffix(VIEW)}" + KEY' in text
    assert f'KEY = "{VIEW}"' in text


def test_settings_of_the_page_are_set_where_nobody_has_set_them():
    text = with_lead(PAGE, "#/a").decode()
    assert all(f'"{name}"' in text for name in SETTINGS)
    assert "localStorage.getItem(name) === null" in text


def test_a_name_in_the_address_ends_no_script():
    assert b"</script><b>" not in with_lead(PAGE, "#/</script><b>")
