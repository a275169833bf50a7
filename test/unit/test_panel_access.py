"""A page of another site, or of a foreign name with this address, gets nothing."""
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb3_labs.panel.access import Access

HOST, ORIGIN = 'localhost:8080', 'http://localhost:8080'
TOKEN = 'Wq3-right_token'


def refusal(host=HOST, origin=ORIGIN, token=None, access=None):
    return (access or Access()).refusal_reason(host, origin, token)


@pytest.mark.parametrize('host', [
    None, '', ':8080', 'evil.com:8080', 'localhost.evil.com', 'evil-localhost', 'localhost.',
    '127.0.0.2', '2130706433', '0.0.0.0', '::1', '[::1]', '[::1]:8080', '[::1', '[::2]:8080', '[::ffff:127.0.0.1]',
    'localhost,evil.com', 'localhost evil.com', 'ｌocalhost', 'localhoſt', '\ud800', '\x00', '[',
    pytest.param('a' * 10000, id='long'), 'evil.com#@localhost', 'evil.com\\@localhost',
    'user:word@localhost:8080', 'localhost/evil.com', 'localhost#evil.com', 'localhost?evil.com',
    'evil[::1]', '[::1]evil.com', '[localhost]', 'localhost:evil.com', 'localhost:80:80',
    'http://localhost', 'localhost\n', ' localhost'])
def test_a_host_is_a_known_name_and_perhaps_a_port(host):
    """RFC 7230, section 5.4: a Host has no user, path, query or fragment."""
    assert 'is not offered as' in refusal(host, None)


@pytest.mark.parametrize('host', [
    'localhost', 'LOCALHOST:8080', '127.0.0.1', '127.0.0.1:8080',
    '192.168.0.7:8080', 'robot-pc.LOCAL'])
def test_names_of_the_loopback_and_of_the_computer_are_accepted(host):
    access = Access(['192.168.0.7', 'Robot-PC.local'])
    assert refusal(host, None, None, access) is None
    assert refusal('evil.com:80', None, None, access) == (
        "this page is not offered as 'evil.com': use one of 127.0.0.1, 192.168.0.7, localhost, "
        'robot-pc.local')


@pytest.mark.parametrize('host, origin', [
    ('LOCALHOST:8080', 'http://localhost:8080'), ('localhost:8080', 'HTTP://LocalHost:8080'),
    ('localhost', 'https://localhost'),
    ('localhost:8080', None)])
def test_the_own_page_and_a_program_without_an_origin_are_accepted(host, origin):
    assert refusal(host, origin) is None


@pytest.mark.parametrize('origin', [
    'http://evil.com:8080', 'null', '', 'file://localhost:8080', 'localhost:8080',
    '//localhost:8080', 'http://localhost', 'http://localhost:8081', 'http://localhost:80800',
    'http://127.0.0.1:8080', 'http://localhost.evil.com:8080', 'http://localhost:8080.evil.com',
    'http://localhost:8080@evil.com', 'http://evil.com@localhost:8080', 'http://[', '\ud800',
    'http://evil.com/http://localhost:8080', 'http://evil.com http://localhost:8080'])
def test_pages_of_other_sites_are_refused(origin):
    assert refusal(HOST, origin) == 'requests of pages of other sites ({}) are refused'.format(
        origin)


@pytest.mark.parametrize('token, valid', [
    (TOKEN, True), (None, True), ('', False), (TOKEN + 'x', False), (TOKEN[:-1], False),
    (TOKEN.lower(), False)])
def test_only_the_whole_token_is_accepted(token, valid):
    reason = refusal(token=token, access=Access(token=TOKEN))
    assert reason == (None if valid else 'the token is missing or wrong: '
                                         'use the whole address that the panel printed')


@pytest.mark.parametrize('token', ['ü', '\U0001f916', '\x00', '\ud800'])
def test_a_token_may_have_any_characters(token):
    assert refusal(token=token, access=Access(token=TOKEN)) is not None
    assert refusal(token=token, access=Access(token=token)) is None


def test_the_token_of_another_name_or_site_is_refused():
    access = Access(token=TOKEN)
    assert refusal('evil.com', None, TOKEN, access) and refusal(HOST, 'null', TOKEN, access)
    # DNS rebinding: Host and Origin agree, but name the attacker's site
    assert refusal('evil.com:8080', 'http://evil.com:8080', TOKEN, access)


NEARLY = st.lists(st.sampled_from([
    'localhost', '127.0.0.1', '[::1]', '::1', 'evil.com', ':', '8080', '@', '#', '/', '?', '\\', '.',
    '[', ']', 'http', '://', '//', 'L', ' ', '\n']) | st.characters(), max_size=6).map(''.join)


@given(NEARLY, st.none() | NEARLY, st.none() | NEARLY)
def test_only_the_loopback_and_the_own_page_are_accepted(host, origin, token):
    is_open = refusal(host, origin, token) is None
    own_name = re.fullmatch(r'(?ai:localhost|127\.0\.0\.1)(:[0-9]*)?', host) is not None
    if origin is None and not token:
        assert is_open is own_name
    elif origin is not None and is_open:
        assert own_name and re.match('https?://' + re.escape(host), origin, re.IGNORECASE)
    assert not (is_open and token)
