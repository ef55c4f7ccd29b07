//! Lines: for people one for each sensor each second, for programs an object for each reading, with the names of the gateway's
//! stream.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::state::{State, Watched};
use crate::feed::News;
use crate::outcome::{DecodeVerdict, Failure};
use crate::say::{Item, Say, thousandths};
use crate::session::{PortOptions, port_failed};

/// From one set of lines to the next.
const EVERY: Duration = Duration::from_secs(1);

/// Prints until the readings end.
pub fn run(state: &mut State, feed: &Receiver<News>, port: &PortOptions) -> Result<DecodeVerdict, Failure> {
    let mut say = port.say();
    let mut next = Instant::now() + EVERY;
    loop {
        match feed.recv_timeout(next.saturating_duration_since(Instant::now())) {
            Ok(News::Lost(error)) => {
                let is_new = state.lost.as_ref().is_none_or(|lost| lost.kind() != error.kind());
                let (kind, why) = (error.kind(), error.message());
                state.take(News::Lost(error));
                if let Some(error) = state.never_opened() {
                    return Err(port_failed(&mut say, error)?);
                }
                if is_new {
                    say.hint(kind, &format!("{why}; it is opened again when it is back"))?;
                }
            }
            Ok(News::Open) => {
                let was_lost = state.lost.is_some();
                state.take(News::Open);
                if was_lost {
                    say.hint("port_back", &format!("{} is back", port.port))?;
                }
            }
            Ok(news) => {
                if let Some(watched) = state.take(news).filter(|_| say.is_for_programs()) {
                    object(&mut say, watched)?;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(DecodeVerdict::Good),
        }
        if next <= Instant::now() {
            next = Instant::now() + EVERY;
            if !say.is_for_programs() {
                lines(&mut say, state)?;
            }
        }
    }
}

fn lines(say: &mut Say, state: &State) -> Result<(), Failure> {
    let now = Instant::now();
    for watched in &state.sensors {
        let angle = watched.mdeg.map_or("-".to_owned(), |mdeg| thousandths(mdeg).to_string());
        let age = watched.at.map_or("never".to_owned(), |at| {
            format!("{:.1} s", now.saturating_duration_since(at).as_secs_f64())
        });
        let rate = watched.rate(now, state.age());
        let (name, status) = (watched.sensor.name(), watched.status);
        say.print(&format!("{name:<12} {angle:>10}  {status:<14} {age:>8}  {rate:>6.1}/s\n"))?;
    }
    Ok(())
}

fn object(say: &mut Say, watched: &Watched) -> Result<(), Failure> {
    let sensor = watched.sensor;
    let text = |text: &str| Item::Text(text.to_owned());
    let age = watched.at.map(|at| i64::try_from(at.elapsed().as_millis()).unwrap_or(i64::MAX));
    let values = [
        ("kind", text(sensor.kind.name())),
        ("address", sensor.address.into()),
        ("axis", sensor.axis.map_or(Item::None, Item::from)),
        ("status", text(watched.status)),
        ("angle_deg", watched.mdeg.map_or(Item::None, thousandths)),
        ("age_ms", age.map_or(Item::None, Item::Number)),
        ("seq", Item::Number(i64::try_from(watched.sequence).unwrap_or(i64::MAX))),
    ];
    Ok(say.line("reading", &values)?)
}
