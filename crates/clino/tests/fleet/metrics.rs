//! What Prometheus scrapes, and what InfluxDB is given.

use std::io::{Read as _, Write as _};
use std::net::{TcpListener, TcpStream};

use crate::gateway::Gateway;
use crate::program::Program;
use crate::{folder, free_port, until};

/// The body of an answer.
pub fn get(port: u16, path: &str) -> Option<(String, String)> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: localhost:{port}\r\nConnection: close\r\n\r\n").ok()?;
    let mut text = String::new();
    stream.read_to_string(&mut text).ok()?;
    let (head, body) = text.split_once("\r\n\r\n")?;
    Some((head.to_owned(), body.to_owned()))
}

#[test]
fn prometheus_finds_no_sample_of_an_angle_that_is_not_ok() {
    let folder = folder("prometheus");
    let (gateway, port) = (Gateway::new(), free_port());
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[gateway.sensors]\n0 = \"a \\\"b\\\\\"\n[prometheus]\nlisten = \"127.0.0.1:{port}\"\n",
        gateway.endpoint()
    );
    let _bridge = Program::bridge(&folder, &configuration);
    gateway.wait_for(1);
    gateway.end_line();
    gateway.angle(0, "-12.345", 2_000, 1);
    gateway.no_angle(1, "no_answer", 1);
    gateway.say(r#"{"stats":"t7","requests":139,"good":106,"no_answer":33,"bad_answer":0,"late":0}"#);
    let text = until("a sample", || {
        let (head, text) = get(port, "/metrics")?;
        assert!(head.contains("application/openmetrics-text"), "{head}");
        (text.contains("clino_angle_degrees{") && text.contains("clino_bus_events_total{")).then_some(text)
    });
    let samples = |name: &str| text.lines().filter(|line| line.starts_with(&format!("{name}{{"))).count();
    assert_eq!(
        (samples("clino_angle_degrees"), samples("clino_sensor_status"), samples("clino_age_seconds")),
        (1, 2, 1),
        "{text}"
    );
    // Labels are escaped as the format wants it.
    let line = text.lines().find(|line| line.starts_with("clino_angle_degrees{")).expect("it is there");
    assert!(line.contains(r#"name="a \"b\\""#) && line.ends_with(" -12.345"), "{line}");
    assert!(text.contains(r#"bus="t7",kind="stats",event="good"} 106"#), "{text}");
    assert!(text.trim_end().ends_with("# EOF"), "{text}");
    gateway.vanish();
    until("the gateway's going", || {
        let (_, text) = get(port, "/metrics")?;
        let is_there = text.lines().any(|line| line.starts_with("clino_angle_degrees{"));
        (text.contains("clino_gateway_up{gateway=\"north\"} 0") && !is_there).then_some(())
    });
}

/// Field by field, as the line protocol reference has it.
#[test]
fn influx_gets_points_of_what_is_ok_and_statuses_of_the_rest() {
    let folder = folder("influx");
    let gateway = Gateway::new();
    let lines = folder.join("lines");
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[gateway.sensors]\n0 = \"a b,c=d\"\n[influx]\nto = \"{}\"\n",
        gateway.endpoint(),
        lines.display()
    );
    let bridge = Program::bridge(&folder, &configuration);
    gateway.wait_for(1);
    gateway.end_line();
    let before = crate::now_ms();
    gateway.angle(0, "-0.001", 5_000, 1);
    gateway.no_angle(1, "stale", 1);
    let text = until("both lines", || {
        let text = std::fs::read_to_string(&lines).ok()?;
        (text.contains("clino_angle,") && text.contains("clino_status,")).then_some(text)
    });
    assert!(bridge.end().success());
    let angle = text.lines().find(|line| line.starts_with("clino_angle,")).expect("it is there");
    let (point, time) = angle.rsplit_once(' ').expect("a time");
    assert_eq!(
        point,
        r"clino_angle,gateway=north,slot=0,kind=t7,bus=t7,address=1,name=a\ b\,c\=d deg=-0.001"
    );
    let ms = time.parse::<i64>().expect("a number") / 1_000_000;
    assert!((before - 7_000..before - 3_000).contains(&ms), "{before} {ms}");
    let status = text.lines().find(|line| line.starts_with("clino_status,")).expect("it is there");
    assert!(status.contains(r#" status="stale",ok=false "#), "{status}");
    assert!(!text.contains("clino_angle,gateway=north,slot=1"), "{text}");
}

/// A server that is away, then there: its lines wait.
#[test]
fn lines_wait_for_a_server_that_is_away() {
    let folder = folder("influx-http");
    let (gateway, port) = (Gateway::new(), free_port());
    let token = folder.join("token");
    std::fs::write(&token, "secret-token\n").expect("a folder of this test");
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[influx]\nto = \"http://127.0.0.1:{port}/api/v2/write?bucket=tilt\"\ntoken = {{ file = \"{}\" }}\n",
        gateway.endpoint(),
        token.display()
    );
    let bridge = Program::bridge(&folder, &configuration);
    gateway.wait_for(1);
    gateway.end_line();
    gateway.angle(0, "7.000", 1, 1);
    let said = until("what is wrong", || Some(bridge.errors()).filter(|said| said.contains("influx: ")));
    assert!(!said.contains("secret-token"), "{said}");
    let listener = TcpListener::bind(("127.0.0.1", port)).expect("the port is free");
    let (mut stream, _) = listener.accept().expect("a connection");
    let mut text = Vec::new();
    let mut chunk = [0; 4_096];
    while !String::from_utf8_lossy(&text).contains("deg=7.000") {
        let count = stream.read(&mut chunk).expect("a request");
        assert!(count > 0, "{}", String::from_utf8_lossy(&text));
        text.extend(&chunk[..count]);
    }
    let text = String::from_utf8_lossy(&text).into_owned();
    assert!(text.starts_with("POST /api/v2/write?bucket=tilt HTTP/1.1\r\n"), "{text}");
    assert!(text.to_lowercase().contains("authorization: token secret-token"), "{text}");
    let _ = stream.write_all(b"HTTP/1.1 204 No Content\r\nContent-Length: 0\r\n\r\n");
}
