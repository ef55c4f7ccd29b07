//! InfluxDB: line protocol to standard output, a file, or a server.
//!
//! | measurement | tags | fields | time |
//! |---|---|---|---|
//! | `clino_angle` | gateway, slot, kind, bus, address, name | `deg` | when it was measured |
//! | `clino_status` | the same | `status`, `ok` | when it was told |
//! | `clino_event` | gateway | `event`, and what belongs to it | when it was told |
//!
//! A point of `clino_angle` is a value that was right and fresh; of anything else there is only a status. Source of the
//! syntax: InfluxData, *Line protocol reference*. The crates that write it are unmaintained or bring a client of a server's
//! own; it is three rules of escaping.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{mpsc, watch};
use tokio::task::JoinHandle;
use tokio::time::interval;

use crate::config::{Influx, InfluxTo};
use crate::health::BridgeHealth;
use crate::hub::{GatewayState, Hub, News, Told};

/// From one writing to the next.
const EVERY: Duration = Duration::from_secs(1);
/// Lines that wait for a server that is away: about 100 MB. The oldest are dropped beyond.
const WAITING: usize = 500_000;
/// Lines of one request, as InfluxData recommends.
const REQUEST: usize = 5_000;
const ANSWER: Duration = Duration::from_secs(10);
const NANOS_PER_MILLI: i64 = 1_000_000;

/// Where lines go.
enum Sink {
    Out(Box<dyn Write + Send>),
    Http { agent: ureq::Agent, url: String, token: Option<String> },
}

/// Begins to write the news of all gateways.
pub fn start(
    config: &Influx,
    hub: &Arc<Hub>,
    health: Arc<BridgeHealth>,
    over: watch::Receiver<bool>,
) -> Result<JoinHandle<()>, String> {
    let sink = match &config.to {
        InfluxTo::Stdout => Sink::Out(Box::new(io::stdout())),
        InfluxTo::File(path) => {
            let file = File::options().create(true).append(true).open(path);
            Sink::Out(Box::new(file.map_err(|why| format!("{}: {why}", path.display()))?))
        }
        InfluxTo::Http(url) => {
            let token = config.token.as_ref().map(crate::config::Secret::read).transpose()?;
            let agent = ureq::Agent::config_builder().timeout_global(Some(ANSWER)).build().into();
            Sink::Http { agent, url: url.clone(), token }
        }
    };
    Ok(tokio::spawn(run(sink, hub.listen(), hub.clone(), health, over)))
}

async fn run(
    mut sink: Sink,
    mut news: mpsc::UnboundedReceiver<Arc<News>>,
    hub: Arc<Hub>,
    health: Arc<BridgeHealth>,
    mut over: watch::Receiver<bool>,
) {
    let mut waiting: Vec<String> = Vec::new();
    let mut tick = interval(EVERY);
    loop {
        let is_over = tokio::select! {
            Some(news) = news.recv() => {
                if let Some(state) = hub.gateway(news.gateway) {
                    waiting.extend(line(&news, &state));
                }
                continue;
            }
            _ = tick.tick() => false,
            _ = over.wait_for(|over| *over) => true,
        };
        while let (true, Ok(news)) = (is_over, news.try_recv()) {
            if let Some(state) = hub.gateway(news.gateway) {
                waiting.extend(line(&news, &state));
            }
        }
        let (back, lines, why) = write(sink, std::mem::take(&mut waiting)).await;
        (sink, waiting) = (back, lines);
        let excess = waiting.len().saturating_sub(WAITING);
        waiting.drain(..excess);
        health.note_lines(waiting.len(), excess, why.as_deref());
        if is_over {
            return;
        }
    }
}

/// Writes on a thread that may block; returns the lines that are left, and why they are.
async fn write(sink: Sink, lines: Vec<String>) -> (Sink, Vec<String>, Option<String>) {
    let written = tokio::task::spawn_blocking(move || {
        let (mut sink, mut lines) = (sink, lines);
        let mut trouble = None;
        while !lines.is_empty() && trouble.is_none() {
            let count = lines.len().min(REQUEST);
            let text: String = lines.iter().take(count).map(String::as_str).collect();
            let (written, result) = sink.write(&text);
            forget(&mut lines, written);
            trouble = result.err();
        }
        (sink, lines, trouble)
    });
    match written.await {
        Ok(written) => written,
        Err(why) => (Sink::Out(Box::new(io::sink())), Vec::new(), Some(why.to_string())),
    }
}

/// Removes what was written: the rest of a line that was written in part is written next.
fn forget(lines: &mut Vec<String>, mut written: usize) {
    let mut whole = 0;
    for line in lines.iter_mut() {
        if line.len() > written {
            *line = line.split_off(written);
            break;
        }
        written -= line.len();
        whole += 1;
    }
    lines.drain(..whole);
}

impl Sink {
    /// Returns how many bytes were written, also if not all were.
    fn write(&mut self, text: &str) -> (usize, Result<(), String>) {
        match self {
            Sink::Out(out) => {
                let mut rest = text.as_bytes();
                while !rest.is_empty() {
                    match out.write(rest) {
                        Ok(0) => return (text.len() - rest.len(), Err("nothing is taken".into())),
                        Ok(count) => rest = rest.get(count..).unwrap_or_default(),
                        Err(why) if why.kind() == io::ErrorKind::Interrupted => {}
                        Err(why) => return (text.len() - rest.len(), Err(why.to_string())),
                    }
                }
                (text.len(), out.flush().map_err(|why| why.to_string()))
            }
            Sink::Http { agent, url, token } => {
                let mut request =
                    agent.post(url.as_str()).header("Content-Type", "text/plain; charset=utf-8");
                if let Some(token) = token {
                    request = request.header("Authorization", format!("Token {token}"));
                }
                match request.send(text) {
                    Ok(_) => (text.len(), Ok(())),
                    Err(why) => (0, Err(why.to_string())),
                }
            }
        }
    }
}

/// A tag's key or value, or a measurement.
fn tag(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            ',' | '=' | ' ' => escaped.extend(['\\', letter]),
            '\n' | '\r' => escaped.push('_'),
            _ => escaped.push(letter),
        }
    }
    // A backslash at the end would escape what follows.
    if escaped.ends_with('\\') {
        escaped.push('_');
    }
    escaped
}

/// A field's text.
fn text(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace(['\n', '\r'], " "))
}

/// The line of a piece of news, if there is one.
fn line(news: &News, state: &GatewayState) -> Option<String> {
    let gateway = tag(state.config.name.as_str());
    let told = news.wall.0.saturating_mul(NANOS_PER_MILLI);
    let event = |what: &str, fields: &str| {
        Some(format!("clino_event,gateway={gateway} event={}{fields} {told}\n", text(what)))
    };
    match &news.told {
        Told::Outcome(slot, outcome) => {
            let mut tags = format!(
                ",gateway={gateway},slot={slot},kind={},bus={},address={}",
                tag(&outcome.kind),
                tag(&outcome.bus),
                outcome.address
            );
            if let Some(name) = state.config.sensor(*slot).filter(|name| !name.is_empty()) {
                _ = write!(tags, ",name={}", tag(name));
            }
            Some(match outcome.value().zip(outcome.measured) {
                Some((angle, measured)) => {
                    let measured = measured.0.saturating_mul(NANOS_PER_MILLI);
                    format!("clino_angle{tags} deg={} {measured}\n", angle)
                }
                None => format!("clino_status{tags} status={},ok=false {told}\n", text(&outcome.status)),
            })
        }
        Told::Speaks => event("online", ""),
        Told::Gone(why) => event("offline", &format!(",why={}", text(why))),
        Told::Start(start) => {
            event("start", &format!(",boot={},cause={}", text(&start.boot()), text(&start.cause)))
        }
        Told::Alarm(alarm) => {
            let fields =
                format!(",slot={}i,alarm={},state={}", alarm.slot, text(&alarm.name), text(&alarm.state));
            event("alarm", &fields)
        }
        Told::Summary(_) | Told::Bus(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk that takes part of a line, and later the rest: the file has whole lines.
    #[test]
    fn a_line_that_was_written_in_part_goes_on_where_it_ended() {
        let mut lines = ["a 1\n", "bb 2\n", "c 3\n"].map(str::to_owned).to_vec();
        forget(&mut lines, 6);
        assert_eq!(lines, [" 2\n", "c 3\n"]);
        forget(&mut lines, 3);
        assert_eq!(lines, ["c 3\n"]);
        forget(&mut lines, 4);
        assert_eq!(lines, [""; 0]);
    }

    /// The reference's own examples of what has to be escaped.
    #[test]
    fn what_has_a_meaning_is_escaped() {
        assert_eq!(tag("Tower, east = 2"), "Tower\\,\\ east\\ \\=\\ 2");
        assert_eq!(tag("a\\"), "a\\_");
        assert_eq!(text(r#"C:\ "x""#), r#""C:\\ \"x\"""#);
    }
}
