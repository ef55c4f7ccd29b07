//! A gateway's console: reads its stream, sends it commands.
//!
//! The console streams after power-up. If another program has left it at a prompt, `watch` brings the stream back.
//!
//! A gateway prints statistics once a second: one that has said nothing for [`SILENCE`] is gone, and its values with it.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::Value;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::sync::mpsc;
use tokio::time::{sleep, timeout_at};

use super::bytes::{self, Bytes};
use super::lines::{self, Line};
use super::{Command, TRY_AGAIN};
use crate::clock::Wall;
use crate::config::{Endpoint, Parity};
use crate::hub::{Hub, Start, Told};

/// The console's (`docs/console.md`).
const BAUD: u32 = 115_200;
/// Five statistics lines that did not come.
const SILENCE: Duration = Duration::from_secs(5);
/// Until the stream is asked for: two statistics lines that did not come.
const ASK_AFTER: Duration = Duration::from_millis(2_500);
/// Lines that are no gateway's, in a row, until the source says so. A gateway's answer to a person has fewer.
const FOREIGN: u32 = 40;
/// What it says then.
const NO_STREAM: &str =
    "what is received is not a clino gateway's stream: is this its console, at 115200 bit/s?";
/// Characters of a line: several times the longest of the console, so that noise without a line end stays bounded.
const LONGEST: usize = 8_192;
/// What asks who the gateway is, and how often in a connection: a console that refuses it, because it wants line checks, is read
/// without.
const WHO: &str = "version";
const WHO_TRIES: u8 = 3;
/// How long the console may take to answer; a scan takes seconds, and shows progress each second.
const ANSWER: Duration = Duration::from_secs(10);

/// Runs the source until the program ends.
pub async fn run(port: Endpoint, hub: Arc<Hub>, gateway: usize, mut commands: mpsc::Receiver<Command>) {
    loop {
        let why = match bytes::open(&port, BAUD, Parity::None).await {
            Ok(stream) => Session::new(stream, &hub, gateway).run(&mut commands).await,
            Err(why) => why,
        };
        let why = if why.starts_with(&port.to_string()) { why } else { format!("{port}: {why}") };
        hub.tell(gateway, Told::Gone(why.clone()));
        let again = Instant::now() + TRY_AGAIN;
        while let Ok(Some(command)) = timeout_at(again.into(), commands.recv()).await {
            // Whoever has asked may have gone.
            let _ = command.answer.send(Err(why.clone()));
        }
        sleep(again.saturating_duration_since(Instant::now())).await;
    }
}

/// One connection.
struct Session<'h> {
    stream: Box<dyn Bytes>,
    hub: &'h Hub,
    gateway: usize,
    received: Vec<u8>,
    /// The rest of a line that was begun before the port was opened, or that is too long: not to be read.
    skips: bool,
    foreign: u32,
    waiting: VecDeque<Waiting>,
    /// A start that was told, and whose cause has been asked for.
    start: Option<(Start, Instant)>,
    /// What is to be sent.
    questions: VecDeque<&'static str>,
    /// How often [`WHO`] was asked.
    tries: u8,
}

/// A command that was sent.
struct Waiting {
    objects: Vec<Value>,
    until: Instant,
    answer: Option<tokio::sync::oneshot::Sender<Result<Vec<Value>, String>>>,
}

impl<'h> Session<'h> {
    fn new(stream: Box<dyn Bytes>, hub: &'h Hub, gateway: usize) -> Session<'h> {
        Session {
            stream,
            hub,
            gateway,
            received: Vec::new(),
            skips: true,
            foreign: 0,
            waiting: VecDeque::new(),
            start: None,
            questions: VecDeque::new(),
            tries: 0,
        }
    }

    /// Runs until the port fails; says why.
    async fn run(mut self, commands: &mut mpsc::Receiver<Command>) -> String {
        let why = loop {
            if let Err(why) = self.step(commands).await {
                break why;
            }
        };
        for waiting in self.waiting {
            if let Some(answer) = waiting.answer {
                let _ = answer.send(Err(why.clone()));
            }
        }
        why
    }

    async fn step(&mut self, commands: &mut mpsc::Receiver<Command>) -> Result<(), String> {
        let (mut asked, mut identified) = (false, false);
        let mut heard = Instant::now();
        let mut chunk = [0; 4_096];
        loop {
            let now = Instant::now();
            self.expire(now);
            while let Some(question) = self.questions.pop_front() {
                self.ask(question, None).await?;
            }
            let due = heard + if asked { SILENCE } else { ASK_AFTER };
            let due = self.waiting.iter().map(|waiting| waiting.until).fold(due, Instant::min);
            tokio::select! {
                // What has come counts before the time that has passed: this computer may be busy.
                biased;
                read = self.stream.read(&mut chunk) => {
                    let count = read.map_err(|why| why.to_string())?;
                    if count == 0 {
                        return Err("the connection was closed".into());
                    }
                    let whole = self.hear(chunk.get(..count).unwrap_or_default())?;
                    if whole {
                        heard = Instant::now();
                        asked = false;
                        if !std::mem::replace(&mut identified, true) {
                            self.ask_who();
                        }
                    }
                }
                Some(command) = commands.recv() => self.ask(&command.line, Some(command.answer)).await?,
                () = tokio::time::sleep_until(due.into()) => {
                    let silent = heard.elapsed();
                    if silent >= SILENCE {
                        return Err(format!("nothing received for {} s", SILENCE.as_secs()));
                    }
                    if silent >= ASK_AFTER && !asked {
                        asked = true;
                        self.write("watch").await?;
                    }
                }
            }
        }
    }

    async fn write(&mut self, line: &str) -> Result<(), String> {
        self.stream.write_all(format!("{line}\r").as_bytes()).await.map_err(|why| why.to_string())
    }

    async fn ask(
        &mut self,
        line: &str,
        answer: Option<tokio::sync::oneshot::Sender<Result<Vec<Value>, String>>>,
    ) -> Result<(), String> {
        self.write(line).await?;
        self.waiting.push_back(Waiting { objects: Vec::new(), until: Instant::now() + ANSWER, answer });
        Ok(())
    }

    /// Commands that were never answered.
    fn expire(&mut self, now: Instant) {
        if self.start.as_ref().is_some_and(|(_, since)| now.saturating_duration_since(*since) >= ANSWER) {
            self.tell_start("", 0);
        }
        while self.waiting.front().is_some_and(|waiting| waiting.until <= now) {
            match self.waiting.pop_front().map(|waiting| waiting.answer) {
                Some(Some(answer)) => {
                    _ = answer.send(Err(format!("no answer within {} s", ANSWER.as_secs())))
                }
                Some(None) => self.ask_who(),
                None => {}
            }
        }
    }

    /// Takes bytes; returns whether a line of a gateway was among them.
    fn hear(&mut self, bytes: &[u8]) -> Result<bool, String> {
        let (at, wall) = (Instant::now(), Wall::now());
        let mut whole = false;
        for &byte in bytes {
            if byte != b'\n' && byte != b'\r' {
                if self.received.len() < LONGEST {
                    self.received.push(byte);
                } else {
                    self.skips = true;
                }
                continue;
            }
            let line = std::mem::take(&mut self.received);
            if std::mem::replace(&mut self.skips, false) || line.is_empty() {
                continue;
            }
            let said = lines::read(&String::from_utf8_lossy(&line), at, wall);
            if matches!(said, Line::Foreign) {
                self.foreign += 1;
                if self.foreign > FOREIGN {
                    return Err(NO_STREAM.into());
                }
                continue;
            }
            (whole, self.foreign) = (true, 0);
            self.hub.tell(self.gateway, Told::Speaks);
            match said {
                Line::Told(told) => self.hub.tell(self.gateway, told),
                Line::Start(start) => {
                    self.start = Some((start, at));
                    self.questions.push_back("reset-cause");
                    // As the first line of a stream it answers nothing.
                    if line.starts_with(b"{\"what\"") {
                        self.answered(Value::Null);
                    }
                }
                Line::Cause(cause, crashes) => {
                    self.tell_start(&cause, crashes);
                    self.answered(Value::Null);
                }
                Line::Answer(object) => self.answered(object),
                Line::Foreign => {}
            }
        }
        if self.received.len() >= LONGEST && !whole {
            self.received.clear();
            self.foreign += 1;
            if self.foreign > FOREIGN {
                return Err(NO_STREAM.into());
            }
        }
        Ok(whole)
    }

    /// Asks who the gateway is, unless that was asked too often.
    fn ask_who(&mut self) {
        if self.tries < WHO_TRIES {
            self.tries += 1;
            self.questions.push_back(WHO);
        }
    }

    /// Tells the start, with its cause if that is known.
    fn tell_start(&mut self, cause: &str, crashes: u32) {
        if let Some((start, _)) = self.start.take() {
            self.hub.tell(self.gateway, Told::Start(Start { cause: cause.to_owned(), crashes, ..start }));
        }
    }

    /// An object that answers the command that waits longest. Progress and what is found do not end an answer.
    fn answered(&mut self, object: Value) {
        let Some(waiting) = self.waiting.front_mut() else { return };
        let goes_on =
            object.get("progress").is_some() || object.get("what").is_some_and(|what| what == "found");
        waiting.until = Instant::now() + ANSWER;
        waiting.objects.push(object);
        if goes_on {
            return;
        }
        match self.waiting.pop_front() {
            Some(Waiting { objects, answer: Some(answer), .. }) => _ = answer.send(Ok(objects)),
            // What was typed before by another program, and is no line of its own, spoils the first question.
            Some(Waiting { objects, answer: None, .. })
                if objects.iter().any(|object| object.get("error").is_some()) =>
            {
                self.ask_who();
            }
            _ => {}
        }
    }
}
