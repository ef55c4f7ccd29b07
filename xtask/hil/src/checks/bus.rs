//! A bus of simulated sensors: every angle right, the line clean, DE in its limits, and a bus that goes dead and comes back.

use super::{Bench, shown};
use crate::console::Console;
use crate::patience;
use crate::sensors::Sensors;

/// The longest wait for an answer that a slot has, ms: USB adds up to 16 ms each way, and a busy computer far more.
const TIMEOUT_MS: u32 = 500;
/// One reading after the other, with room for late answers, ms.
const PERIOD_MS: u32 = 600;
/// From the last stop bit to DE low at most, ns: the virtual board's rule.
const LONGEST_RELEASE_NS: u64 = 10_000;
/// Requests after which the line's counters are read.
const REQUESTS: u64 = 10;

/// A simulated sensor and its slot in the image as delivered.
struct Sensor {
    slot: u64,
    /// As `clino sim` takes it.
    option: &'static str,
    angle: f64,
}

/// What is checked of a bus.
pub struct Bus {
    /// In commands.
    name: &'static str,
    /// In texts.
    pub title: &'static str,
    baud: u32,
    sensors: &'static [Sensor],
    /// Half a step of the sensor's output, and half of the console's last decimal, degrees.
    tolerance: f64,
    /// Bytes of the request for an angle.
    request: u32,
}

/// Get Angle has 3 bytes.
pub const T7: Bus = Bus {
    name: "t7",
    title: "T7",
    baud: 115_200,
    sensors: &[
        Sensor { slot: 0, option: "1,angle=12.345", angle: 12.345 },
        Sensor { slot: 1, option: "2,angle=-170.5", angle: -170.5 },
        Sensor { slot: 2, option: "3,angle=0.001", angle: 0.001 },
    ],
    tolerance: 0.000_5,
    request: 3,
};

/// Read RAM has 5 bytes; a turn is 65536 steps.
pub const ISU: Bus = Bus {
    name: "isu",
    title: "ISU",
    baud: 9_600,
    sensors: &[Sensor { slot: 3, option: "1,angle=271.25", angle: 271.25 }],
    tolerance: 360.0 / 65_536.0 / 2.0 + 0.000_5,
    request: 5,
};

const WIRES: &str = "A and B exchanged? ground between adapter and board; 120 ohm at both ends; supply of the transceiver; \
                     no other sensor on the pair; the adapter's own direction control";

impl Bus {
    /// Checks the bus with its sensors behind the adapter at this port; they go on answering, if the port can be used.
    pub fn check(&self, bench: &mut Bench, port: &str) -> Result<Option<Sensors>, String> {
        for Sensor { slot, .. } in self.sensors {
            bench.console.ask(&format!("set {slot} timeout {TIMEOUT_MS} period {PERIOD_MS}"))?;
        }
        let mut sensors = match self.serve(bench, port) {
            Ok(sensors) => sensors,
            Err(why) => {
                let what = format!("{} bus: adapter", self.title);
                bench.report.check(what, "sensors behind it", Err(why), "`clino ports`");
                return Ok(None);
            }
        };
        let found = self.angles(bench, "angles");
        if found && !bench.arguments.short && !bench.arguments.on_qemu {
            self.line(bench);
            drop(sensors);
            let dead = self.all(&mut bench.console, |object| {
                object["status"] == "no_answer" && object["angle_deg"].is_null()
            });
            bench.report.check(
                format!("{} bus: sensors that stop to answer", self.title),
                "no_answer, no angle",
                dead.map(|shown| (shown, true)),
                "a pair that is not idle when nothing drives it: bias, termination; another sensor on the pair",
            );
            sensors = self.serve(bench, port)?;
            self.angles(bench, "angles after that");
        }
        Ok(Some(sensors))
    }

    fn serve(&self, bench: &Bench, port: &str) -> Result<Sensors, String> {
        let options =
            self.sensors.iter().flat_map(|sensor| [format!("--{}", self.name), sensor.option.to_owned()]);
        Sensors::serve(&bench.arguments.programs, &options.collect::<Vec<_>>(), port)
    }

    /// Every slot of the bus has its angle; whether it has.
    fn angles(&self, bench: &mut Bench, what: &str) -> bool {
        let right = self.all(&mut bench.console, |object| {
            let truth = self.sensors.iter().find(|sensor| object["slot"] == sensor.slot);
            let angle = object["angle_deg"].as_f64();
            object["status"] == "ok"
                && truth
                    .zip(angle)
                    .is_some_and(|(truth, angle)| (angle - truth.angle).abs() <= self.tolerance)
        });
        let good = right.is_ok();
        let truths: Vec<String> = self.sensors.iter().map(|sensor| format!("{:.3}", sensor.angle)).collect();
        bench.report.check(
            format!("{} bus: {what}", self.title),
            format!("{} deg, within {:.4}", truths.join(", "), self.tolerance),
            right.map(|shown| (shown, true)),
            WIRES,
        );
        good
    }

    /// Waits until this holds of every slot of the bus; what they are then.
    fn all(
        &self,
        console: &mut Console,
        holds: impl Fn(&serde_json::Value) -> bool,
    ) -> Result<String, String> {
        patience::until(patience::STATE, || {
            let list = console.ask("list")?;
            let ours: Vec<_> = list
                .iter()
                .filter(|object| self.sensors.iter().any(|sensor| object["slot"] == sensor.slot))
                .collect();
            let shown: Vec<String> = ours.iter().map(|object| shown(object)).collect();
            let shown = shown.join(", ");
            let all = ours.len() == self.sensors.len() && ours.iter().all(|object| holds(object));
            Ok(if all { Ok(shown) } else { Err(shown) })
        })
    }

    /// What the board itself has counted and measured on the line.
    fn line(&self, bench: &mut Bench) {
        let counted = self.counters(&mut bench.console);
        let (line, times) = match counted {
            Ok(counted) => counted,
            Err(why) => {
                bench.report.check(format!("{} bus: counters", self.title), "", Err(why), WIRES);
                return;
            }
        };
        let faults = ["framing", "noise", "overrun", "forced"];
        let shown: Vec<String> = faults.iter().map(|name| format!("{name} {}", line[*name])).collect();
        let clean = faults.iter().all(|name| line[*name] == 0);
        bench.report.check(
            format!("{} bus: counters", self.title),
            "all 0",
            Ok((shown.join(", "), clean)),
            "10 kohm from RO to 3.3 V (RO floats while the receiver is off), 10 kohm from DE to ground; the bit rate of the adapter",
        );
        let release = times["de_release_max_ns"].as_u64();
        bench.report.check(
            format!("{} bus: last stop bit to DE low, longest", self.title),
            format!("at most {} us", LONGEST_RELEASE_NS / 1_000),
            Ok((
                format!("{:.3} us", release.unwrap_or(0) as f64 / 1e3),
                release.is_some_and(|ns| ns > 0 && ns <= LONGEST_RELEASE_NS),
            )),
            "an interrupt that is held off: a debugger that halts, a changed image",
        );
        // The frame, a bit before it, and the release.
        let bit_us = 1e6 / f64::from(self.baud);
        let (frame, most) = {
            let frame = f64::from(self.request) * 10.0 * bit_us;
            (frame, frame + bit_us + LONGEST_RELEASE_NS as f64 / 1e3)
        };
        let high = times["de_high_max_us"].as_f64();
        bench.report.check(
            format!("{} bus: DE high, longest", self.title),
            format!("{frame:.0} to {most:.0} us"),
            Ok((
                format!("{} us", times["de_high_max_us"]),
                high.is_some_and(|high| high >= frame.floor() && high <= most.ceil()),
            )),
            "`bus`: --pre and --post are to be 0; the bit rate of the bus; the crystal",
        );
    }

    /// Line and times of the bus after some requests with a clean start.
    fn counters(&self, console: &mut Console) -> Result<(serde_json::Value, serde_json::Value), String> {
        console.ask("counters clear")?;
        patience::until(patience::STATE, || {
            let counters = console.ask("counters")?;
            let stats = Console::find(&counters, "stats", self.name)?;
            let requests = stats["requests"].as_u64().unwrap_or(0);
            if requests < REQUESTS {
                return Ok(Err(format!("{requests} requests")));
            }
            let line = Console::find(&counters, "line", self.name)?;
            Ok(Ok((line, Console::find(&counters, "times", self.name)?)))
        })
    }
}
