//! Who may read and who may write.
//!
//! | listening at | reading | writing (with `--allow-writes`) |
//! |---|---|---|
//! | loopback | everybody on this computer | everybody on this computer, from this page |
//! | beyond | with the token | with the token, from this page |
//!
//! A request that names another host than the one that is listened at is refused: otherwise a page from elsewhere could reach
//! loopback through a name of its own (DNS rebinding). What writes has to come from this very page: `Origin` is compared with
//! `Host`. No header allows other origins.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Query, Request, State};
use axum::http::header::{
    AUTHORIZATION, CONTENT_SECURITY_POLICY, COOKIE, HOST, LOCATION, ORIGIN, REFERRER_POLICY, SET_COOKIE,
    X_CONTENT_TYPE_OPTIONS, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;

use super::Shared;

/// Of the cookie that stands for the token.
const COOKIE_NAME: &str = "clino_token";
/// Short ones can be guessed.
const SHORTEST: usize = 16;

/// The rules of this page.
pub struct Access {
    is_loopback: bool,
    allows_writes: bool,
    token: Option<String>,
}

impl Access {
    /// For a page that listens here.
    ///
    /// # Errors
    /// It would be open to others without a token, or the token is too short.
    pub fn new(listen: SocketAddr, allows_writes: bool, token: Option<String>) -> Result<Access, String> {
        let is_loopback = listen.ip().is_loopback();
        if let Some(token) = &token
            && (token.len() < SHORTEST
                || !token.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte)))
        {
            return Err(format!("the token needs {SHORTEST} or more letters, digits, `-`, `_`, `.`, `~`"));
        }
        if !is_loopback && token.is_none() {
            return Err(format!("{listen} can be reached by others: that needs a token, see `token`"));
        }
        Ok(Access { is_loopback, allows_writes, token })
    }

    pub fn allows_writes(&self) -> bool {
        self.allows_writes
    }

    fn knows_host(&self, headers: &HeaderMap) -> bool {
        let Some(host) = headers.get(HOST).and_then(|host| host.to_str().ok()) else { return false };
        // Beyond loopback a page from elsewhere lacks the cookie, whatever name it uses.
        !self.is_loopback || is_loopback_name(host)
    }

    fn knows_token(&self, headers: &HeaderMap) -> bool {
        let Some(token) = &self.token else { return true };
        let of = |name| headers.get_all(name).iter().filter_map(|value| value.to_str().ok());
        let in_cookie = of(COOKIE)
            .flat_map(|cookies| cookies.split(';'))
            .filter_map(|cookie| cookie.trim().strip_prefix(COOKIE_NAME)?.strip_prefix('='))
            .any(|value| is_same(value, token));
        in_cookie
            || of(AUTHORIZATION)
                .filter_map(|value| value.strip_prefix("Bearer "))
                .any(|value| is_same(value, token))
    }
}

/// `localhost`, an address of loopback, with or without a port.
fn is_loopback_name(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split_once(']').map_or("", |(address, _)| address),
        None => host.split_once(':').map_or(host, |(name, _)| name),
    };
    name.eq_ignore_ascii_case("localhost") || name.parse().is_ok_and(|address: IpAddr| address.is_loopback())
}

/// Compares in a time that depends on the length alone.
fn is_same(one: &str, other: &str) -> bool {
    one.len() == other.len() && one.bytes().zip(other.bytes()).fold(0, |unlike, (a, b)| unlike | (a ^ b)) == 0
}

/// Whether a request comes from a page of this very server.
fn is_from_here(headers: &HeaderMap) -> bool {
    let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    match (text(ORIGIN), text(HOST)) {
        (Some(origin), Some(host)) => {
            origin.split_once("://").is_some_and(|(_, from)| from.eq_ignore_ascii_case(host))
        }
        // No browser leaves it out of a POST; a program has the token or is on this computer.
        (None, Some(_)) => true,
        _ => false,
    }
}

/// Lets a request through, or does not.
pub async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let headers = request.headers();
    if !shared.access.knows_host(headers) {
        return (StatusCode::MISDIRECTED_REQUEST, "this page is reached as localhost\n").into_response();
    }
    if !shared.access.knows_token(headers) {
        return (StatusCode::UNAUTHORIZED, "this page needs its token: /login?token=...\n").into_response();
    }
    let is_writing = request.method() != Method::GET && request.method() != Method::HEAD;
    if is_writing && !shared.access.allows_writes() {
        return (StatusCode::FORBIDDEN, "started without --allow-writes\n").into_response();
    }
    if is_writing && !is_from_here(headers) {
        return (StatusCode::FORBIDDEN, "not from this page\n").into_response();
    }
    next.run(request).await
}

#[derive(Deserialize)]
pub struct Login {
    token: String,
}

/// Takes the token into a cookie, so that it is in no address that is kept.
pub async fn login(State(shared): State<Arc<Shared>>, Query(login): Query<Login>) -> Response {
    if shared.access.token.as_ref().is_none_or(|token| !is_same(&login.token, token)) {
        return (StatusCode::UNAUTHORIZED, "not the token of this page\n").into_response();
    }
    let cookie = format!("{COOKIE_NAME}={}; HttpOnly; SameSite=Strict; Path=/", login.token);
    (StatusCode::SEE_OTHER, [(SET_COOKIE, cookie), (LOCATION, "/".to_owned())]).into_response()
}

/// What a browser may do with whatever this server answers. Plotly sets styles from its script.
pub async fn harden(mut response: Response) -> Response {
    const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; \
                          connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let headers = response.headers_mut();
    headers.insert(CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
    headers.insert(REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(axum::http::HeaderName, &str)]) -> HeaderMap {
        pairs
            .iter()
            .map(|(name, value)| (name.clone(), HeaderValue::from_str(value).expect("a value")))
            .collect()
    }

    #[test]
    fn beyond_loopback_nothing_is_open_without_a_token() {
        let beyond = SocketAddr::from(([0, 0, 0, 0], 8080));
        let loopback = SocketAddr::from(([127, 0, 0, 1], 8080));
        assert!(Access::new(beyond, false, None).is_err());
        assert!(Access::new(beyond, false, Some("short".into())).is_err());
        assert!(Access::new(beyond, false, Some("0123456789abcde;".into())).is_err());
        assert!(Access::new(loopback, true, None).is_ok());
        let access = Access::new(beyond, false, Some("0123456789abcdef".into())).expect("a token");
        assert!(!access.knows_token(&headers(&[])));
        for (value, is_it) in [
            ("0123456789abcdef", true),
            ("0123456789abcdeF", false),
            ("", false),
            ("0123456789abcdef0", false),
        ] {
            assert_eq!(access.knows_token(&headers(&[(AUTHORIZATION, &format!("Bearer {value}"))])), is_it);
            assert_eq!(
                access.knows_token(&headers(&[(COOKIE, &format!("a=b; clino_token={value}"))])),
                is_it
            );
            assert!(!access.knows_token(&headers(&[(COOKIE, &format!("xclino_token={value}"))])));
        }
    }

    #[test]
    fn a_name_that_leads_to_loopback_is_not_its_name() {
        for host in
            ["localhost", "localhost:8080", "LOCALHOST:1", "127.0.0.1:8080", "[::1]:8080", "127.9.9.9"]
        {
            assert!(is_loopback_name(host), "{host}");
        }
        for host in [
            "evil.example",
            "localhost.evil.example:8080",
            "127.0.0.1.evil.example",
            "10.0.0.1",
            "[::2]:1",
            "",
            "[",
        ] {
            assert!(!is_loopback_name(host), "{host}");
        }
    }

    #[test]
    fn only_this_page_writes() {
        let from = |origin| is_from_here(&headers(&[(HOST, "localhost:8080"), (ORIGIN, origin)]));
        assert!(from("http://localhost:8080"));
        for origin in ["http://localhost:8081", "http://evil.example", "null", "localhost:8080", ""] {
            assert!(!from(origin), "{origin}");
        }
    }
}
