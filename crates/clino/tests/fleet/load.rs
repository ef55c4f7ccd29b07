//! Figures of a fleet, with a real broker: 300 gateways of 32 sensors at 1 Hz, and an hour without the broker. Ignored:
//! `cargo xtask campaign fleet` prints them.
//!
//! The gateways are one process of this test: a thread writes all their lines. The time of reception is the instant at which a
//! line is written; the broker's own client tells when a message came.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, ChildStdout, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use clino_testkit::programs::Mosquitto;

use crate::broker::{Broker, mosquitto};
use crate::program::Program;
use crate::{folder, free_port, now_ms, until};

const GATEWAYS: usize = 300;
const SENSORS: usize = 32;
/// How long the fleet runs.
const SECONDS: u32 = 60;
/// Clock ticks of a second in `/proc` (POSIX `CLK_TCK`, 100 on Linux).
const TICKS: f64 = 100.0;

/// Processor seconds and resident megabytes of a process.
fn used(pid: u32) -> (f64, f64) {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).expect("it runs");
    let fields: Vec<_> = stat.rsplit_once(')').expect("a name").1.split_whitespace().collect();
    let ticks: f64 =
        fields[11].parse::<f64>().expect("a number") + fields[12].parse::<f64>().expect("a number");
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).expect("it runs");
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("its peak");
    let kb: f64 = line.split_whitespace().nth(1).expect("a number").parse().expect("a number");
    (ticks / TICKS, kb / 1_000.0)
}

/// One listener for all gateways: connections in the order in which they come.
fn fleet() -> (u16, Arc<Mutex<Vec<TcpStream>>>) {
    let listener = TcpListener::bind(("127.0.0.1", 0)).expect("loopback");
    let port = listener.local_addr().expect("it is bound").port();
    let streams: Arc<Mutex<Vec<TcpStream>>> = Arc::default();
    let to = streams.clone();
    thread::spawn(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            let _ = stream.set_nodelay(true);
            // What is asked is not answered: nothing here depends on it.
            let _ = stream.set_nonblocking(false);
            to.lock().expect("no panic").push(stream);
        }
    });
    (port, streams)
}

/// A client that prints every batch of every gateway in this format.
fn states(mosquitto: &Mosquitto, broker: &Broker, format: &str) -> (Child, ChildStdout) {
    let mut subscriber = mosquitto.subscriber();
    let port = broker.port().to_string();
    subscriber.args(["-h", "127.0.0.1", "-p", &port, "-q", "0", "-t", "clino/+/state", "-F", format]);
    let mut child = subscriber.stdout(Stdio::piped()).spawn().expect("mosquitto_sub starts");
    let out = child.stdout.take().expect("it is piped");
    (child, out)
}

fn configuration(source: u16, broker: u16, folder: &std::path::Path) -> String {
    let mut text = String::new();
    for n in 0..GATEWAYS {
        text += &format!("[[gateway]]\nname = \"g{n}\"\nconsole = \"tcp://127.0.0.1:{source}\"\n");
    }
    text + &format!(
        "[mqtt]\nhost = \"127.0.0.1\"\nport = {broker}\n[store]\nfolder = \"{}\"\nmost_mb = 8000\n",
        folder.display()
    )
}

/// The lines of a gateway in a second: the angle tells the instant at which they are written, in ms of the last 6 minutes.
fn lines(seq: u32, stamp_ms: i64) -> String {
    let code = stamp_ms % 360_000;
    let angle = format!("{}.{:03}", code / 1_000, code % 1_000);
    (0..SENSORS)
        .map(|slot| {
            format!(
                "{{\"slot\":{slot},\"kind\":\"t7\",\"bus\":\"t7\",\"address\":{},\"status\":\"ok\",\"angle_deg\":{angle},\"age_ms\":0,\"health\":[],\"seq\":{seq}}}\r\n",
                slot + 1
            )
        })
        .collect()
}

#[test]
#[ignore = "a minute of full load: cargo xtask campaign fleet"]
fn three_hundred_gateways_on_one_broker() {
    let Some(mosquitto) = mosquitto("fleet load") else { return };
    let folder = folder("load");
    let broker = Broker::start(&mosquitto, &folder);
    let (port, streams) = fleet();
    // Receive time in seconds with decimals, then the message.
    let (mut child, out) = states(&mosquitto, &broker, "%U %p");
    let heard: Arc<Mutex<(Vec<i64>, u64)>> = Arc::default();
    let to = heard.clone();
    thread::spawn(move || {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            let Some((time, message)) = line.split_once(' ') else { continue };
            let came = (time.parse::<f64>().unwrap_or(0.0) * 1_000.0) as i64;
            let mut heard = to.lock().expect("no panic");
            for part in message.split("\"angle_deg\":").skip(1) {
                let number = part.split(',').next().unwrap_or_default();
                let (whole, decimals) = number.split_once('.').unwrap_or((number, "0"));
                let code = whole.parse::<i64>().unwrap_or(0) * 1_000 + decimals.parse::<i64>().unwrap_or(0);
                heard.0.push((came % 360_000 - code).rem_euclid(360_000));
                heard.1 += 1;
            }
        }
    });
    let bridge = Program::bridge(&folder, &configuration(port, broker.port(), &folder));
    until("all gateways", || (streams.lock().expect("no panic").len() >= GATEWAYS).then_some(()));
    thread::sleep(Duration::from_secs(2));
    for stream in streams.lock().expect("no panic").iter_mut() {
        stream.write_all(b"\r\n").expect("a connection");
    }
    let (before, _) = used(bridge.id());
    let begun = Instant::now();
    for second in 0..SECONDS {
        for n in 0..GATEWAYS {
            // Spread over the second, as gateways are that know nothing of each other.
            let due = Duration::from_secs(second.into())
                + Duration::from_secs(1) * u32::try_from(n).expect("few") / GATEWAYS as u32;
            thread::sleep(due.saturating_sub(begun.elapsed()));
            let text = lines(second + 1, now_ms());
            streams.lock().expect("no panic")[n].write_all(text.as_bytes()).expect("a connection");
        }
    }
    let sent = u64::from(SECONDS) * (GATEWAYS * SENSORS) as u64;
    until("the last value", || (heard.lock().expect("no panic").1 >= sent).then_some(()));
    let (after, peak_mb) = used(bridge.id());
    let core = (after - before) / begun.elapsed().as_secs_f64() * 100.0;
    let mut delays = std::mem::take(&mut heard.lock().expect("no panic").0);
    delays.sort_unstable();
    let at = |share: f64| delays[((delays.len() - 1) as f64 * share) as usize];
    let got = delays.len() as u64;
    println!(
        "values sent {sent}, received {got}; ms from reception to the broker's client: median {}, p99 {}, most {}",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    println!("one core {core:.1} %, {peak_mb:.0} MB");
    let _ = child.kill();
    assert_eq!(got, sent);
    assert!(at(0.99) <= 50, "p99 {} ms", at(0.99));
    assert!(core <= 50.0, "{core:.1} % of a core");
    assert!(peak_mb <= 200.0, "{peak_mb:.0} MB");
}

/// Messages of an hour: 300 gateways, one message a second.
const HOUR: usize = GATEWAYS * 3_600;

/// Fills a store as the bridge would within an hour. Its format is restated from `crates/fleet/src/store.rs`: messages by their
/// number, each with a byte for *retained*, the length of its topic, topic and payload; counters beside them.
fn fill(path: &std::path::Path) -> u64 {
    let database = redb::Database::create(path).expect("a folder of this test");
    let queue = redb::TableDefinition::<u64, &[u8]>::new("queue");
    let counters = redb::TableDefinition::<&str, u64>::new("counters");
    let values: Vec<_> = (0..SENSORS)
        .map(|slot| {
            format!(
                "{{\"slot\":{slot},\"kind\":\"t7\",\"bus\":\"t7\",\"address\":{},\"status\":\"ok\",\"angle_deg\":12.345,\"ts\":1795990330138,\"outcome\":1,\"health\":[]}}",
                slot + 1
            )
        })
        .collect();
    let values = values.join(",");
    let (mut number, mut bytes) = (0, 0);
    for second in 0..3_600_u64 {
        let transaction = database.begin_write().expect("the disk has room");
        {
            let mut queue = transaction.open_table(queue).expect("a table");
            for gateway in 0..GATEWAYS {
                let topic = format!("clino/g{gateway}/state");
                let seq = (1_u64 << 32) + second + 1;
                let payload =
                    format!("{{\"ts\":{second},\"seq\":{seq},\"boot\":null,\"values\":[{values}]}}");
                let mut message = vec![0, 0, u8::try_from(topic.len()).expect("short")];
                message.extend(topic.bytes().chain(payload.bytes()));
                bytes += message.len() as u64;
                queue.insert(number, message.as_slice()).expect("the disk has room");
                number += 1;
            }
            let mut counters = transaction.open_table(counters).expect("a table");
            for (name, value) in [("runs", 1), ("end", number), ("bytes", bytes)] {
                counters.insert(name, value).expect("the disk has room");
            }
        }
        transaction.commit().expect("the disk has room");
    }
    bytes
}

/// The broker comes back after an hour.
#[test]
#[ignore = "gigabytes on disk: cargo xtask campaign fleet"]
fn an_hour_without_the_broker_is_delivered_within_five_minutes() {
    let Some(mosquitto) = mosquitto("fleet hour") else { return };
    let folder = folder("hour");
    let (port, _streams) = fleet();
    let at = free_port();
    let text = configuration(port, at, &folder);
    let bytes = fill(&folder.join("bridge.redb"));
    let size = std::fs::metadata(folder.join("bridge.redb")).expect("the store").len();
    println!("{} MB of messages take {} MB on disk", bytes / 1_000_000, size / 1_000_000);
    let broker = Broker::start_with(&mosquitto, &folder, at, "allow_anonymous true\n");
    let (mut child, out) = states(&mosquitto, &broker, "%t %p");
    let begun = Instant::now();
    let _bridge = Program::bridge(&folder, &text);
    let mut last: BTreeMap<String, u64> = BTreeMap::new();
    let (mut values, mut messages) = (0_u64, 0_usize);
    let wanted = (HOUR * SENSORS) as u64;
    for line in BufReader::new(out).lines().map_while(Result::ok) {
        let Some((topic, message)) = line.split_once(' ') else { continue };
        let seq =
            message.split("\"seq\":").nth(1).and_then(|rest| rest.split(',').next()?.parse::<u64>().ok());
        let seq = seq.expect("a number");
        let before = last.insert(topic.to_owned(), seq).unwrap_or(0);
        assert!(seq > before, "{topic}: {seq} after {before}");
        values += message.matches("\"status\":\"ok\"").count() as u64;
        messages += 1;
        if values >= wanted {
            break;
        }
        assert!(begun.elapsed() < Duration::from_secs(600), "{values} of {wanted} after ten minutes");
    }
    let _ = child.kill();
    println!(
        "{values} values in {messages} messages were delivered in {:.0} s, in order",
        begun.elapsed().as_secs_f64()
    );
    assert_eq!(values, wanted);
    assert!(begun.elapsed() <= Duration::from_secs(300));
    let _ = std::fs::remove_dir_all(&folder);
}

/// A number of protobuf: seven bits a byte, the lowest first (*Encoding*, *Base 128 Varints*).
fn varint(mut number: u64, to: &mut Vec<u8>) {
    while number >= 0x80 {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

/// Fills a store as the bridge would with Sparkplug. Its format is restated from `crates/fleet/src/mqtt/sparkplug/reading.rs`: a
/// table for each gateway, of records of 32 readings.
fn fill_sparkplug(path: &std::path::Path, begun_ms: u64) {
    let database = redb::Database::create(path).expect("a folder of this test");
    let counters = redb::TableDefinition::<&str, u64>::new("counters");
    for gateway in 0..GATEWAYS {
        let transaction = database.begin_write().expect("the disk has room");
        {
            let name = format!("queue g{gateway}");
            let table = redb::TableDefinition::<u64, &[u8]>::new(&name);
            let mut queue = transaction.open_table(table).expect("a table");
            let mut bytes = 0;
            for second in 0..3_600_u64 {
                // Not retained, and without a topic: its length is 0.
                let mut message = vec![0, 0, 0];
                for slot in 0..SENSORS as u64 {
                    let mut reading = Vec::new();
                    // 1: slot, 2: place, 3: status, 4: millidegrees (zigzag), 5: time.
                    reading.push(1 << 3);
                    varint(slot, &mut reading);
                    reading.extend(b"\x12\x04t7 1\x1a\x02ok");
                    reading.push(4 << 3);
                    varint(2 * 12_345, &mut reading);
                    reading.push(5 << 3);
                    varint(begun_ms + second * 1_000, &mut reading);
                    message.push(1 << 3 | 2);
                    varint(reading.len() as u64, &mut message);
                    message.extend(reading);
                }
                bytes += message.len() as u64;
                queue.insert(second, message.as_slice()).expect("the disk has room");
            }
            let mut counters = transaction.open_table(counters).expect("a table");
            for (name, value) in
                [("runs", 1), (&*format!("end g{gateway}"), 3_600), (&*format!("bytes g{gateway}"), bytes)]
            {
                counters.insert(name, value).expect("the disk has room");
            }
        }
        transaction.commit().expect("the disk has room");
    }
}

/// The time of the first metric of a payload: fields 1 and 2, then field 3 of the metric (Sparkplug 3.0.0, section 6.4.1).
fn first_time(payload: &[u8]) -> Option<u64> {
    let number = |bytes: &mut &[u8]| {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let (byte, rest) = bytes.split_first()?;
            *bytes = rest;
            number |= u64::from(byte & 0x7F) << shift;
            if byte & 0x80 == 0 {
                return Some(number);
            }
        }
        None
    };
    let mut rest = payload;
    loop {
        let tag = number(&mut rest)?;
        let value = number(&mut rest)?;
        match tag {
            // The payload's time; a metric, whose fields follow; the time of a metric.
            0x08 | 0x12 => {}
            0x18 => return Some(value),
            // A name.
            0x0A => rest = rest.get(usize::try_from(value).ok()?..)?,
            _ => return None,
        }
    }
}

/// The broker comes back after an hour, with Sparkplug: everything is delivered as history.
#[test]
#[ignore = "a gigabyte on disk: cargo xtask campaign fleet"]
fn an_hour_without_the_broker_is_history_of_sparkplug_within_five_minutes() {
    use std::io::Read as _;
    let Some(mosquitto) = mosquitto("fleet Sparkplug hour") else { return };
    let folder = folder("sparkplug-hour");
    let (port, _streams) = fleet();
    let at = free_port();
    let text = configuration(port, at, &folder).replace("[mqtt]\n", "[mqtt]\ndialect = \"sparkplug\"\n");
    let begun_ms = u64::try_from(now_ms()).expect("after 1970") - 3_600_000;
    let store = folder.join("bridge-sparkplug.redb");
    fill_sparkplug(&store, begun_ms);
    let size = std::fs::metadata(&store).expect("the store").len();
    let broker = Broker::start_with(&mosquitto, &folder, at, "allow_anonymous true\n");
    let mut subscriber = mosquitto.subscriber();
    let broker_port = broker.port().to_string();
    // Topic and length on a line, then the payload and the end of a line.
    subscriber.args(["-h", "127.0.0.1", "-p", &broker_port, "-t", "spBv1.0/+/DDATA/#", "-F", "%t %l\\n%p"]);
    let mut child = subscriber.stdout(Stdio::piped()).spawn().expect("mosquitto_sub starts");
    let mut out = BufReader::new(child.stdout.take().expect("it is piped"));
    let begun = Instant::now();
    let bridge = Program::bridge(&folder, &text);
    let mut last: BTreeMap<String, u64> = BTreeMap::new();
    let (mut values, mut messages, mut repeated) = (0, 0, 0);
    let wanted = HOUR * SENSORS;
    while values < wanted {
        let mut line = String::new();
        out.read_line(&mut line).expect("a line");
        let (topic, length) = line.trim_end().rsplit_once(' ').expect("a topic and a length");
        let mut payload = vec![0; length.parse::<usize>().expect("a length") + 1];
        out.read_exact(&mut payload).expect("a payload");
        let time = first_time(&payload).expect("a metric");
        let before = last.insert(topic.to_owned(), time).unwrap_or(0);
        // What was not answered when a connection broke comes again, from the first of it on.
        if time <= before {
            last.insert(topic.to_owned(), before);
            repeated += 1;
            continue;
        }
        // A metric of this name for each value.
        values += payload.windows(7).filter(|part| *part == b"\x0A\x05Angle").count();
        messages += 1;
        assert!(begun.elapsed() < Duration::from_secs(600), "{values} of {wanted} after ten minutes");
    }
    let took = begun.elapsed();
    let (_, peak_mb) = used(bridge.id());
    let _ = child.kill();
    let _ = child.wait();
    println!(
        "Sparkplug: {} MB on disk; {values} values in {messages} messages were delivered in {:.0} s, in order, {repeated} messages twice; {peak_mb:.0} MB",
        size / 1_000_000,
        took.as_secs_f64()
    );
    assert_eq!(values, wanted);
    assert!(took <= Duration::from_secs(300));
    let _ = std::fs::remove_dir_all(&folder);
}

/// Sensors of the page, and how often each has a value.
const PAGE_SENSORS: u16 = 48;
const PAGE_HZ: u32 = 10;
const PAGE_SECONDS: u32 = 20;

/// 48 sensors ten times a second: more than a console carries, as much as Modbus at 115200 bit/s.
#[test]
#[ignore = "a browser and a quiet computer: cargo xtask campaign fleet"]
fn the_page_with_48_sensors_ten_times_a_second() {
    let Some((chromium, node)) = crate::browser::browser("fleet page load") else { return };
    let folder = folder("page-load");
    let gateway = Arc::new(crate::gateway::Gateway::new());
    let port = free_port();
    let (endpoint, listen) = (gateway.endpoint(), format!("127.0.0.1:{port}"));
    let mut serve = Program::start(&folder, &["serve", "--port", &endpoint, "--listen", &listen]);
    let address = serve.first_line().replace("127.0.0.1", "localhost");
    gateway.wait_for(1);
    gateway.end_line();
    let is_over = Arc::new(std::sync::atomic::AtomicBool::new(false));
    let (speaker, over) = (gateway.clone(), is_over.clone());
    let speaking = thread::spawn(move || {
        let begun = Instant::now();
        let mut round = 0_u32;
        while !over.load(std::sync::atomic::Ordering::Relaxed) {
            round += 1;
            for slot in 0..PAGE_SENSORS {
                let angle = format!("{}.{:03}", round % 90, (round * 37 + u32::from(slot)) % 1_000);
                speaker.angle(slot, &angle, 1, round);
            }
            thread::sleep((Duration::from_secs(1) * round / PAGE_HZ).saturating_sub(begun.elapsed()));
        }
    });
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fleet/frames.js");
    let (before, _) = used(serve.id());
    let begun = Instant::now();
    let mut browser = node.command();
    browser
        .arg(script)
        .arg(&chromium.program)
        .arg(&address)
        .args([PAGE_SENSORS.to_string(), PAGE_SECONDS.to_string()]);
    let output = browser.output().expect("node starts");
    let (after, peak_mb) = used(serve.id());
    let core = (after - before) / begun.elapsed().as_secs_f64() * 100.0;
    is_over.store(true, std::sync::atomic::Ordering::Relaxed);
    speaking.join().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}");
    let figures: serde_json::Value = serde_json::from_str(text.trim()).expect("JSON");
    let figure = |name: &str| figures[name].as_f64().expect("a number");
    println!(
        "{PAGE_SENSORS} sensors at {PAGE_HZ} Hz: {:.0} frames/s, {:.0} changed texts/s; server {core:.1} % of a core, {peak_mb:.0} MB",
        figure("fps"),
        figure("changes")
    );
    assert!(figure("fps") >= 30.0 && figure("changes") >= 100.0, "{text}");
    assert!(core <= 5.0, "{core:.1} % of a core");
}
