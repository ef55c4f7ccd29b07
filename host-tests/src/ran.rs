//! One run of the image, from power-up to the end of its scenario.

use std::env;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use clino_board::analysis::Analysis;
use clino_board::checker::{self, Reading};
use clino_board::console::Line;
use clino_board::elf::Image;
use clino_board::impairment::Impaired;
use clino_board::incident::{Event, Incident};
use clino_board::pwm::Pulse;
use clino_board::reception::Reception;
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_board::{BoardModel, HostPorts};
use defmt_decoder::Table;

/// A reading as it came over the console.
#[derive(Clone, Debug)]
pub struct Spoken {
    /// First start bit of its line, ns since power-up.
    pub began: u64,
    /// Last stop bit of its line, ns since power-up.
    pub at: u64,
    /// What it says.
    pub reading: Reading,
}

impl Spoken {
    /// Status is ok, and there is an angle.
    pub fn is_ok(&self) -> bool {
        self.reading.status == "ok" && self.reading.angle_deg.is_some()
    }
}

/// What a run left behind.
pub struct Ran {
    /// Every console line.
    pub lines: Vec<Line>,
    /// The console lines that are readings.
    pub spoken: Vec<Spoken>,
    /// What the wire log of the T7 bus says.
    pub t7: Analysis,
    /// What the wire log of the ISU bus says.
    pub isu: Analysis,
    /// True edges of both PWM inputs.
    pub pulses: [Vec<Pulse>; 2],
    /// The firmware's log: one line per message, without its time.
    pub log: Vec<String>,
    /// The bus log as text.
    pub bus_log: Vec<u8>,
    /// What arrived at the console and at the Modbus port, with the flags of the receiver.
    pub received: HostPorts<Vec<Reception>>,
    /// What was done to it before.
    pub impaired: HostPorts<Vec<Impaired>>,
    /// Resets, planted faults, a crystal that stops.
    pub incidents: Vec<Incident>,
    /// The summary for humans.
    pub summary: String,
    /// Lowest stack pointer seen.
    pub lowest_sp: u32,
    /// The simulator has nothing to complain about.
    pub all_well: bool,
}

impl Ran {
    /// The readings of a slot, in order.
    pub fn slot(&self, slot: u32) -> impl Iterator<Item = &Spoken> {
        self.spoken.iter().filter(move |spoken| spoken.reading.slot == slot)
    }
}

/// Runs a scenario given as text.
pub fn run(scenario: &str) -> Ran {
    go(Scenario::parse(Path::new("test"), scenario))
}

/// Runs a scenario file of the repository.
pub fn run_file(name: &str) -> Ran {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios");
    go(Scenario::read(&folder.join(name)))
}

fn go(scenario: Result<Scenario, impl std::fmt::Display>) -> Ran {
    let scenario = scenario.unwrap_or_else(|error| panic!("{error}"));
    let mut run = Run::new(image(), &scenario).unwrap_or_else(|error| panic!("{error}"));
    let mut lines = Vec::new();
    run.finish(|line| lines.push(line.clone()));
    let incidents = run.incidents();
    let spoken = lines.iter().filter(|line| !is_torn(line, &incidents)).filter_map(spoken).collect();
    let mut analyses = run.analyses().into_iter().map(|(_, analysis)| analysis);
    let (Some(t7), Some(isu)) = (analyses.next(), analyses.next()) else { panic!("there are two buses") };
    let mut bus_log = Vec::new();
    run.write_bus_log(&mut bus_log).expect("memory does not fail");
    let (summary, all_well) = run.summary();
    let pulses = [0, 1].map(|input| run.board().pwm_log(input));
    let received = run.receptions();
    let of = run.impairments();
    let impaired =
        HostPorts { console: of.console.lock().log().to_vec(), modbus: of.modbus.lock().log().to_vec() };
    let lowest_sp = run.board().stats().lowest_sp.unwrap_or(u32::MAX);
    let log = decode(&run.board().take_rtt());
    Ran {
        lines,
        spoken,
        t7,
        isu,
        pulses,
        log,
        bus_log,
        received,
        impaired,
        incidents,
        summary,
        lowest_sp,
        all_well,
    }
}

/// A reset has cut the line short: what comes after it is printed on.
fn is_torn(line: &Line, incidents: &[Incident]) -> bool {
    let resets = incidents.iter().filter(|incident| matches!(incident.event, Event::Reset(_)));
    resets.map(|reset| reset.at).any(|at| (line.began..=line.at).contains(&at))
}

fn spoken(line: &Line) -> Option<Spoken> {
    // What is said to people is no object.
    if !line.text.starts_with('{') {
        return None;
    }
    let reading = checker::parse(&line.text).unwrap_or_else(|error| panic!("{error}: {}", line.text))?;
    Some(Spoken { began: line.began, at: line.at, reading })
}

/// What the firmware logged, in words. The strings are in the image file only.
fn decode(rtt: &[u8]) -> Vec<String> {
    let elf = std::fs::read(elf()).unwrap_or_else(|error| panic!("{error}"));
    let table = Table::parse(&elf).expect("the image has a log table").expect("the image logs");
    let mut decoder = table.new_stream_decoder();
    decoder.received(rtt);
    let mut log = Vec::new();
    while let Ok(frame) = decoder.decode() {
        log.push(frame.display_message().to_string());
    }
    log
}

/// The image.
///
/// # Panics
/// It is not there.
pub fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| Image::read(&elf(), model()).unwrap_or_else(|error| panic!("{error}")))
}

/// The board that it is for: the one that `CLINO_BOARD` names, or the default one.
///
/// # Panics
/// There is no board of that name.
pub fn model() -> BoardModel {
    let name = env::var("CLINO_BOARD").unwrap_or_default();
    if name.is_empty() {
        return BoardModel::default();
    }
    name.parse().unwrap_or_else(|error| panic!("CLINO_BOARD: {error}"))
}

/// The image's file.
pub fn elf() -> PathBuf {
    let path = env::var_os("CLINO_ELF").map(PathBuf::from);
    path.expect("CLINO_ELF names the firmware image: run these tests with `cargo xtask test`")
}
