//! The real programs that keep history and health: Prometheus scrapes the bridge, InfluxDB takes its lines.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, Stdio};

use clino_testkit::programs::{Monitor, skipped};

use crate::documents::document;
use crate::gateway::Gateway;
use crate::metrics::get;
use crate::program::Program;
use crate::{folder, free_port, until};

/// A program that is ended with its test.
pub struct Running(Child);

impl Running {
    fn start(command: &mut std::process::Command, log: &std::path::Path) -> Running {
        Running::start_with(command.stdin(Stdio::null()).stdout(Stdio::null()), log)
    }

    /// With its own input and output.
    pub fn start_with(command: &mut std::process::Command, errors: &std::path::Path) -> Running {
        let errors = std::fs::File::create(errors).expect("a folder of this test");
        Running(command.stderr(errors).spawn().expect("it starts"))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn prometheus_has_a_value_while_it_is_right_and_none_when_the_gateway_is_gone() {
    let prometheus = match Monitor::prometheus(crate::programs()) {
        Ok(prometheus) => prometheus,
        Err(why) => return skipped("fleet Prometheus", &why),
    };
    let folder = folder("real-prometheus");
    let (gateway, metrics, port) = (Gateway::new(), free_port(), free_port());
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[prometheus]\nlisten = \"127.0.0.1:{metrics}\"\n",
        gateway.endpoint()
    );
    let _bridge = Program::bridge(&folder, &configuration);
    // The recipe of the document as it stands, but for the port; it asks more often, so that the test is short.
    let page = document("docs/fleet.md");
    let recipe = page.split('`').find(|part| part.starts_with("scrape_configs: ")).expect("a recipe");
    assert_eq!(recipe.matches("localhost:9184").count(), 1, "{recipe}");
    let recipe = recipe.replace("localhost:9184", &format!("localhost:{metrics}"));
    let scrape = format!("global: {{scrape_interval: 1s}}\n{recipe}\n");
    let file = folder.join("prometheus.yml");
    std::fs::write(&file, scrape).expect("a folder of this test");
    let mut command = prometheus.command();
    command.arg(format!("--config.file={}", file.display()));
    command.arg(format!("--storage.tsdb.path={}", folder.join("data").display()));
    command.arg(format!("--web.listen-address=127.0.0.1:{port}"));
    let _running = Running::start(&mut command, &folder.join("prometheus.log"));
    gateway.wait_for(1);
    gateway.end_line();
    gateway.angle(0, "-12.345", 1, 1);
    let asked = |query: &str| Some(get(port, &format!("/api/v1/query?query={query}"))?.1);
    let found = until("a sample in Prometheus", || {
        // The gateway goes on speaking: one that is silent is gone after five seconds.
        gateway.angle(0, "-12.345", 1, 2);
        asked("clino_angle_degrees").filter(|text| text.contains("-12.345"))
    });
    assert!(found.contains("\"gateway\":\"north\"") && found.contains("\"slot\":\"0\""), "{found}");
    gateway.vanish();
    until("no sample any more", || {
        asked("clino_angle_degrees").filter(|text| text.contains("\"result\":[]"))
    });
    until("the gateway is down", || asked("clino_gateway_up").filter(|text| text.contains("\"0\"]")));
}

#[test]
fn influxdb_takes_the_lines_with_the_time_of_the_measurement() {
    let influxd = match Monitor::influxd(crate::programs()) {
        Ok(influxd) => influxd,
        Err(why) => return skipped("fleet InfluxDB", &why),
    };
    let folder = folder("real-influx");
    let (gateway, port, inner) = (Gateway::new(), free_port(), free_port());
    let at = |name: &str| folder.join(name).display().to_string();
    let text = format!(
        "reporting-disabled = true\nbind-address = \"127.0.0.1:{inner}\"\n[meta]\ndir = \"{}\"\n[data]\ndir = \"{}\"\nwal-dir = \"{}\"\n[http]\nbind-address = \"127.0.0.1:{port}\"\n",
        at("meta"),
        at("data"),
        at("wal")
    );
    let file = folder.join("influx.conf");
    std::fs::write(&file, text).expect("a folder of this test");
    let _running = Running::start(influxd.command().arg("-config").arg(&file), &folder.join("influx.log"));
    until("InfluxDB", || {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
        let head = format!(
            "POST /query?q=CREATE%20DATABASE%20tilt HTTP/1.1\r\nHost: localhost:{port}\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).ok()?;
        let mut answer = String::new();
        stream.read_to_string(&mut answer).ok()?;
        answer.starts_with("HTTP/1.1 200").then_some(())
    });
    let configuration = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[gateway.sensors]\n0 = \"a b,c=d\"\n[influx]\nto = \"http://127.0.0.1:{port}/write?db=tilt\"\n",
        gateway.endpoint()
    );
    let bridge = Program::bridge(&folder, &configuration);
    gateway.wait_for(1);
    gateway.end_line();
    let before = crate::now_ms();
    gateway.angle(0, "-12.345", 60_000, 1);
    gateway.no_angle(1, "no_answer", 1);
    let query = "/query?db=tilt&epoch=ms&q=SELECT%20deg%2C%22name%22%20FROM%20clino_angle";
    let found =
        until("a point in InfluxDB", || Some(get(port, query)?.1).filter(|text| text.contains("-12.345")));
    assert!(found.contains("a b,c=d"), "{found}");
    let time =
        found.split("\"values\":[[").nth(1).and_then(|rest| rest.split(',').next()?.parse::<i64>().ok());
    let time = time.expect("a time");
    assert!((before - 62_000..before - 50_000).contains(&time), "{before} {time}");
    let query = "/query?db=tilt&q=SELECT%20status%20FROM%20clino_status";
    until("a status in InfluxDB", || Some(get(port, query)?.1).filter(|text| text.contains("no_answer")));
    assert!(!bridge.errors().contains("influx"), "{}", bridge.errors());
}
