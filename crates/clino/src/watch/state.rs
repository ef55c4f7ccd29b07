//! What is known of the sensors that are watched.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::feed::News;
use crate::port::PortError;
use crate::sensors::Sensor;

/// How far back the plot goes.
pub const SHOWN: Duration = Duration::from_secs(180);
/// Readings of this long make the rate.
const RATE_OVER: Duration = Duration::from_secs(5);
/// Points of a plot: more than a wide terminal has dots.
const MOST_POINTS: usize = 2_000;

/// A sensor, as it was last heard.
pub struct Watched {
    pub sensor: Sensor,
    /// In 0.001°.
    pub mdeg: Option<i32>,
    pub status: &'static str,
    /// When it had its last value.
    pub at: Option<Instant>,
    /// The values of the last minutes.
    pub points: VecDeque<(Instant, i32)>,
    recent: VecDeque<Instant>,
    /// Outcomes, good or bad.
    pub sequence: u64,
}

/// All of them, and the port.
pub struct State {
    pub sensors: Vec<Watched>,
    /// What is wrong with the port.
    pub lost: Option<PortError>,
    was_open: bool,
    began: Instant,
}

impl State {
    /// Nothing yet.
    pub fn new(sensors: Vec<Sensor>) -> Self {
        let watched = |sensor| Watched {
            sensor,
            mdeg: None,
            status: "never_read",
            at: None,
            points: VecDeque::new(),
            recent: VecDeque::new(),
            sequence: 0,
        };
        let sensors = sensors.into_iter().map(watched).collect();
        Self { sensors, lost: None, was_open: false, began: Instant::now() }
    }

    /// The problem of a port that was not opened once.
    pub fn never_opened(&self) -> Option<&PortError> {
        self.lost.as_ref().filter(|_| !self.was_open)
    }

    /// Takes what has come; the sensor that it is about.
    pub fn take(&mut self, news: News) -> Option<&Watched> {
        match news {
            News::Open => {
                self.was_open = true;
                self.lost = None;
                None
            }
            News::Lost(error) => {
                for sensor in &mut self.sensors {
                    (sensor.mdeg, sensor.status) = (None, error.kind());
                }
                self.lost = Some(error);
                None
            }
            News::Reading { sensor, at, result, .. } => {
                let watched = self.sensors.get_mut(sensor)?;
                watched.sequence += 1;
                match result {
                    Ok(measured) => {
                        (watched.mdeg, watched.status, watched.at) = (Some(measured.mdeg), "ok", Some(at));
                        watched.recent.push_back(at);
                        watched.points.push_back((at, measured.mdeg));
                    }
                    Err(status) => (watched.mdeg, watched.status) = (None, status.name()),
                }
                watched.forget(at);
                Some(watched)
            }
        }
    }

    /// Whether [`Watched::rate`] has something to go by.
    pub fn age(&self) -> Duration {
        self.began.elapsed()
    }
}

impl Watched {
    fn forget(&mut self, now: Instant) {
        let is_older = |at: &Instant, span: Duration| now.saturating_duration_since(*at) > span;
        while self.points.len() > MOST_POINTS
            || self.points.front().is_some_and(|(at, _)| is_older(at, SHOWN))
        {
            self.points.pop_front();
        }
        while self.recent.front().is_some_and(|at| is_older(at, RATE_OVER)) {
            self.recent.pop_front();
        }
    }

    /// Values in a second, over the last seconds.
    pub fn rate(&self, now: Instant, watched_for: Duration) -> f64 {
        let over = RATE_OVER.min(watched_for).as_secs_f64();
        let count = self.recent.iter().filter(|at| now.saturating_duration_since(**at) <= RATE_OVER).count();
        if over > 0.0 { count as f64 / over } else { 0.0 }
    }
}
