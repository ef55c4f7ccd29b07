//! The live page without a browser: who gets what.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;

use serde_json::Value;

use crate::gateway::Gateway;
use crate::metrics::get;
use crate::program::Program;
use crate::{folder, free_port, until};

/// Status of an answer to a request with these lines.
fn asked(port: u16, request: &str, head: &[&str], body: &str) -> (u16, String) {
    let mut stream = until("the page", || TcpStream::connect(("127.0.0.1", port)).ok());
    let head: String = head.iter().map(|line| format!("{line}\r\n")).collect();
    write!(
        stream,
        "{request} HTTP/1.1\r\nConnection: close\r\n{head}Content-Length: {}\r\n\r\n{body}",
        body.len()
    )
    .expect("it listens");
    let mut text = String::new();
    stream.read_to_string(&mut text).expect("an answer");
    let status = text.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    (status, text)
}

fn state(port: u16) -> Option<Value> {
    serde_json::from_str(&get(port, "/api/state")?.1).ok()
}

#[test]
fn values_come_and_go_with_the_gateway() {
    let folder = folder("page");
    let (gateway, port) = (Gateway::new(), free_port());
    let mut serve = Program::start(
        &folder,
        &["serve", "--port", &gateway.endpoint(), "--listen", &format!("127.0.0.1:{port}")],
    );
    assert_eq!(serve.first_line(), format!("http://127.0.0.1:{port}/"));
    gateway.wait_for(1);
    gateway.end_line();
    gateway.angle(0, "-12.345", 100, 1);
    let sensor =
        |state: &Value| state["gateways"][0]["sensors"].as_array().and_then(|all| all.first().cloned());
    let first = until("a value", || sensor(&state(port)?).filter(|sensor| sensor["status"] == "ok"));
    assert_eq!((&first["angle_mdeg"], &first["address"]), (&(-12_345).into(), &1.into()));
    assert!(first["age_ms"].as_u64().is_some_and(|age| (100..30_000).contains(&age)));
    let history = get(port, "/api/history?gateway=gateway&slot=0&span_s=60").expect("an answer").1;
    let history: Value = serde_json::from_str(&history).expect("JSON");
    assert!(
        history["lowest"].as_array().is_some_and(|all| all.iter().any(|value| *value == -12.345)),
        "{history}"
    );
    let (head, csv) = get(port, "/api/csv?gateway=gateway&slot=0&span_s=60").expect("an answer");
    assert!(
        head.contains("text/csv")
            && csv.starts_with("utc,lowest_deg,highest_deg\r\n")
            && csv.contains(",-12.345,-12.345\r\n")
    );
    for bad in ["/api/history?gateway=x&slot=0&span_s=60", "/api/history?gateway=gateway&slot=9&span_s=60"] {
        assert!(get(port, bad).expect("an answer").0.starts_with("HTTP/1.1 404"), "{bad}");
    }
    assert!(
        get(port, "/api/csv?gateway=gateway&slot=0&span_s=5")
            .expect("an answer")
            .0
            .starts_with("HTTP/1.1 400")
    );
    gateway.vanish();
    let gone =
        until("the going", || sensor(&state(port)?).filter(|sensor| sensor["status"] == "source_gone"));
    assert_eq!(gone["angle_mdeg"], Value::Null);
}

#[test]
fn nothing_is_written_but_from_this_page_and_only_if_allowed() {
    let folder = folder("writes");
    let gateway = Gateway::new();
    let zero = r#"{"gateway":"gateway","command":"zero","slot":3}"#;
    for allows in [false, true] {
        let port = free_port();
        let listen = format!("127.0.0.1:{port}");
        let endpoint = gateway.endpoint();
        let mut arguments = vec!["serve", "--port", &endpoint, "--listen", &listen];
        if allows {
            arguments.push("--allow-writes");
        }
        let mut serve = Program::start(&folder, &arguments);
        serve.first_line();
        gateway.wait_for(1 + usize::from(allows));
        gateway.end_line();
        gateway.angle(0, "1.000", 1, 1);
        until("the gateway", || (state(port)?["gateways"][0]["gone"].is_null()).then_some(()));
        let host = format!("Host: localhost:{port}");
        let json = "Content-Type: application/json";
        let from = |origin: &str| {
            asked(port, "POST /api/command", &[&host, json, &format!("Origin: {origin}")], zero).0
        };
        let here = format!("http://localhost:{port}");
        assert_eq!(from(&here), if allows { 200 } else { 403 });
        for elsewhere in ["http://evil.example", "http://localhost:1", "null"] {
            assert_eq!(from(elsewhere), 403, "{elsewhere}");
        }
        // A name of another host that leads here.
        let rebound = asked(port, "GET /api/state", &["Host: evil.example"], "").0;
        assert_eq!(rebound, 421);
        let (_, text) = asked(port, "GET /api/state", &[&host, "Origin: http://evil.example"], "");
        assert!(!text.to_lowercase().contains("access-control-allow"), "{text}");
        assert!(text.to_lowercase().contains("content-security-policy: default-src 'none'"), "{text}");
        if allows {
            let scan =
                asked(port, "POST /api/command", &[&host, json], r#"{"gateway":"gateway","command":"scan"}"#);
            assert!(scan.0 == 200 && scan.1.contains("swept"), "{scan:?}");
            for bad in [
                r#"{"gateway":"gateway","command":"reboot"}"#,
                r#"{"gateway":"gateway","command":"zero","slot":"0 --yes"}"#,
            ] {
                assert_eq!(asked(port, "POST /api/command", &[&host, json], bad).0, 422, "{bad}");
            }
            assert_eq!(
                asked(port, "POST /api/command", &[&host, json], r#"{"gateway":"x","command":"scan"}"#).0,
                404
            );
        }
    }
    let zeroed = gateway.asked().iter().filter(|line| line.starts_with("zero")).count();
    assert_eq!((zeroed, gateway.asked().contains(&"zero 3".to_owned())), (1, true));
}

#[test]
fn beyond_loopback_everything_needs_the_token() {
    let folder = folder("token");
    let gateway = Gateway::new();
    let port = free_port();
    let (listen, endpoint) = (format!("0.0.0.0:{port}"), gateway.endpoint());
    let without = Program::start(&folder, &["serve", "--port", &endpoint, "--listen", &listen]);
    until("a refusal", || Some(without.errors()).filter(|said| said.contains("token")));
    let token = folder.join("token");
    std::fs::write(&token, "0123456789abcdef\n").expect("a folder of this test");
    let mut serve = Program::start(
        &folder,
        &["serve", "--port", &endpoint, "--listen", &listen, "--token-file", &token.display().to_string()],
    );
    serve.first_line();
    let host = format!("Host: 192.0.2.1:{port}");
    for path in ["/", "/page.js", "/api/state", "/api/events", "/api/csv?gateway=gateway&slot=0&span_s=60"] {
        assert_eq!(asked(port, &format!("GET {path}"), &[&host], "").0, 401, "{path}");
    }
    assert_eq!(asked(port, "GET /login?token=0123456789abcdeX", &[&host], "").0, 401);
    let (status, text) = asked(port, "GET /login?token=0123456789abcdef", &[&host], "");
    assert!(status == 303 && text.contains("HttpOnly; SameSite=Strict"), "{text}");
    assert_eq!(asked(port, "GET /api/state", &[&host, "Cookie: clino_token=0123456789abcdef"], "").0, 200);
    assert_eq!(asked(port, "GET /api/state", &[&host, "Authorization: Bearer 0123456789abcdef"], "").0, 200);
    let said = serve.errors();
    assert!(!said.contains("0123456789abcdef"), "{said}");
}

/// What an attacker or a broken program sends: each is refused, and the page goes on.
#[test]
fn requests_that_are_none_are_refused_and_nothing_leaves_the_program() {
    let folder = folder("hostile");
    let (gateway, port) = (Gateway::new(), free_port());
    let listen = format!("127.0.0.1:{port}");
    let endpoint = gateway.endpoint();
    let mut serve =
        Program::start(&folder, &["serve", "--port", &endpoint, "--listen", &listen, "--allow-writes"]);
    serve.first_line();
    let host = format!("Host: localhost:{port}");
    for path in [
        "/../Cargo.toml",
        "/..%2f..%2fetc%2fpasswd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/page.js/../../../etc/passwd",
        "/page.js%00.html",
        "//etc/passwd",
        "/api/state/",
        "/API/STATE",
        "/metrics",
        "/.git/config",
    ] {
        let (status, text) = asked(port, &format!("GET {path}"), &[&host], "");
        assert!(status == 404 && !text.contains("root:"), "{path}: {text}");
    }
    for (request, status) in [
        ("POST /", 405),
        ("PUT /api/command", 405),
        ("DELETE /api/state", 405),
        ("GET /api/command", 405),
        ("GET /api/history?gateway=gateway&slot=65536&span_s=60", 400),
        ("GET /api/history?gateway=gateway&slot=0&span_s=4294967296", 400),
        ("GET /api/csv?gateway=%0d%0aSet-Cookie:x=1&slot=0&span_s=60", 404),
        ("GET /login?token=", 401),
        ("GET /login", 400),
    ] {
        assert_eq!(asked(port, request, &[&host], "").0, status, "{request}");
    }
    let json = "Content-Type: application/json";
    let long = format!("{{\"gateway\":\"{}\"}}", "x".repeat(3_000_000));
    for (head, body, status) in [
        (&[host.as_str(), json][..], "{", 400),
        (&[&host, json], "[]", 422),
        (&[&host], "{}", 415),
        (&[&host, "Content-Type: text/plain"], r#"{"gateway":"gateway","command":"scan"}"#, 415),
        (&[&host, json], &long, 413),
    ] {
        assert_eq!(asked(port, "POST /api/command", head, body).0, status, "{head:?} {:.40}", body);
    }
    // Headers beyond any measure, no host, two hosts, no HTTP: a refusal or an end, never a page.
    let long = format!("X: {}", "x".repeat(1_000_000));
    let many: String = (0..1_000).map(|n| format!("X-{n}: x\r\n")).collect();
    for text in [
        format!("GET / HTTP/1.1\r\n{host}\r\n{long}\r\n\r\n"),
        format!("GET / HTTP/1.1\r\n{host}\r\n{many}\r\n"),
        format!("GET /{} HTTP/1.1\r\n{host}\r\n\r\n", "x".repeat(1_000_000)),
        "GET / HTTP/1.1\r\n\r\n".to_owned(),
        "GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n".to_owned(),
        "\x16\x03\x01\x02\x00\x01\x00\x01".to_owned(),
        "CONNECT evil.example:80 HTTP/1.1\r\nHost: evil.example:80\r\n\r\n".to_owned(),
        "\r\n\r\n\r\n\r\n".to_owned(),
    ] {
        let mut stream = until("the page", || TcpStream::connect(("127.0.0.1", port)).ok());
        // It may close before everything is written.
        let _ = stream.write_all(text.as_bytes());
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer);
        assert!(!answer.starts_with("HTTP/1.1 2"), "{text:.60}: {answer}");
    }
    assert_eq!(asked(port, "GET /", &[&host], "").0, 200, "the page goes on");
    assert_eq!(
        gateway.asked().iter().filter(|line| line.contains("scan") || line.contains("zero")).count(),
        0
    );
}
