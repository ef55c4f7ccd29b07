//! The power fails while the shipped image stores its configuration: in steps of saves that fill and erase sectors, the next
//! start finds the old configuration or the new one.

use std::ops::Range;
use std::path::Path;

use clino_board::Stopped;
use clino_board::elf::Image;
use clino_board::run::Run;
use clino_board::scenario::Scenario;

use crate::{MS, SECOND, typed};

/// When typing begins, in ms,
const SOON: u64 = 60;
/// and after a cut: the start may have to erase a sector first.
const LATER: u64 = 700;
/// Saves in one life while nothing is cut.
const AT_ONCE: u32 = 12;
/// Periods of slot 0 by which configurations are told apart begin here, in ms.
const FIRST: u32 = 101;

fn image() -> Image {
    clino_host_tests::image().clone()
}

/// What one life of the board came to.
struct Life {
    /// The period of slot 0 as the console told it at the start; empty if it did not come to that.
    found: String,
    /// The save was answered.
    saved: bool,
    stored: Vec<u8>,
    /// Words programmed and sectors erased.
    steps: u64,
    erased: bool,
}

/// Starts with this in the sectors, asks what slot 0 is set to, has it set to each of these periods and saved; the power
/// fails in this step.
fn live(stored: &[u8], more: &[String], periods: Range<u32>, cut: Option<u64>, begin: u64) -> Life {
    let mut text = "duration = \"10s\"\n".to_owned() + &typed(begin, "show 0");
    let set = periods.clone().flat_map(|period| [format!("slot 0 t7 1 -p {period}"), "save".into()]);
    let mut at = begin + 20;
    for line in more.iter().cloned().chain(set) {
        text += &typed(at, &line);
        // The longest save without an erase.
        at += if line == "save" { 50 } else { 10 };
    }
    let scenario = Scenario::parse(Path::new("power"), &text).unwrap_or_else(|error| panic!("{error}"));
    let image = image().with_stored(stored).expect("it fits");
    let mut run = Run::new(&image, &scenario).unwrap_or_else(|error| panic!("{error}"));
    if let Some(step) = cut {
        run.board().cut_power_at(step, step.wrapping_mul(0x9E37_79B9));
    }
    let (mut found, mut saves, mut going) = (None, 0, true);
    while going && saves < periods.len() {
        going = run.go_on_by(20 * MS, |line| {
            let period =
                line.text.split("\"period_ms\":").nth(1).and_then(|rest| rest.split([',', '}']).next());
            found = found.take().or(period.map(str::to_owned));
            saves += usize::from(line.text.contains("\"stored\""));
        });
    }
    if cut.is_some() {
        let later = run.now() + SECOND;
        let end = run.board().run_until(later);
        assert!(matches!(end, Err(Stopped::PowerLost { .. })), "the power was cut");
    }
    let stats = run.board().stats();
    Life {
        found: found.unwrap_or_default(),
        saved: saves == periods.len(),
        stored: run.board().stored(),
        steps: stats.flash_steps,
        // A step is a word of 16 us, or an erase of half a second.
        erased: stats.stalled_cycles > 168_000 * 400,
    }
}

/// What cuts have led to.
#[derive(Default)]
struct Cuts {
    old: u32,
    new: u32,
}

impl Cuts {
    /// Cuts the save of this number in some of its steps, and looks at what the next start finds.
    fn cut(&mut self, stored: &[u8], number: u32, steps: u64, every: u64) {
        // The first steps and the last, and some between.
        let picked =
            |step: &u64| *step <= 2 || *step + 2 > steps || (step + u64::from(number)).is_multiple_of(every);
        for step in (1..=steps).filter(picked) {
            let torn = live(stored, &[], number..number + 1, Some(step), SOON);
            assert!(!torn.saved, "step {step} of {steps}");
            let next = live(&torn.stored, &[], 99..100, None, LATER);
            match next.found.parse::<u32>() {
                Ok(found) if found == number => self.new += 1,
                Ok(found) if found == number - 1 => self.old += 1,
                _ => panic!("period {} after a cut in step {step} of {steps} of save {number}", next.found),
            }
            assert!(next.saved, "and it can be saved again");
        }
    }
}

#[test]
fn a_cut_in_any_step_leaves_the_old_configuration_or_the_new_one() {
    let every = std::env::var("CLINO_EVERY_CUT").map_or(11, |text| text.parse().expect("a number"));
    let mut all: Vec<String> =
        (1..32).map(|slot| format!("slot {slot} t7 {} -p 0 -s 1000", slot + 1)).collect();
    all.extend((32..46).map(|slot| format!("slot {slot} isu {}", slot - 31)));
    let mut stored = live(&[], &all, FIRST..FIRST + 1, None, SOON).stored;
    let mut number = FIRST + 1;
    let mut cuts = Cuts::default();
    let mut compactions = 0;
    while compactions < 2 {
        let batch = live(&stored, &[], number..number + AT_ONCE, None, SOON);
        assert_eq!(batch.found, (number - 1).to_string(), "what was saved last is in force");
        if !batch.erased {
            assert!(batch.saved);
            (stored, number) = (batch.stored, number + AT_ONCE);
            continue;
        }
        // One of them erases a sector, and what is typed meanwhile is lost: one by one.
        loop {
            let whole = live(&stored, &[], number..number + 1, None, SOON);
            assert!(whole.saved && whole.found == (number - 1).to_string());
            if whole.erased || compactions == 0 {
                cuts.cut(&stored, number, whole.steps, every);
            }
            (stored, number) = (whole.stored, number + 1);
            if whole.erased {
                compactions += 1;
                break;
            }
        }
    }
    println!(
        "shipped image: {} saves, {compactions} compactions, cut {} times: {} times the old configuration, {} times the new one",
        number - FIRST,
        cuts.old + cuts.new,
        cuts.old,
        cuts.new
    );
    assert!(cuts.old > 0 && cuts.new > 0);
}
