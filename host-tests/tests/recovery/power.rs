//! The power fails while the shipped image stores its configuration: in steps of saves that fill and erase sectors, the next
//! start finds the old configuration or the new one.

use std::path::Path;

use clino_board::Stopped;
use clino_board::elf::Image;
use clino_board::run::Run;
use clino_board::scenario::Scenario;

use crate::{MS, SECOND, typed};

/// Saves of the longest configuration, all slots set, that fill a sector.
const PER_SECTOR: u32 = 8;
/// The first of them begins a sector, so that every run of this many makes two compactions at least.
const SAVES: u32 = 2 * PER_SECTOR + 2;
/// Periods of slot 0 by which configurations are told apart, in ms.
const FIRST: u32 = 101;

fn image() -> Image {
    let elf = std::env::var_os("CLINO_ELF");
    let elf = elf.expect("CLINO_ELF names the firmware image: run these tests with `cargo xtask test`");
    Image::read(Path::new(&elf)).unwrap_or_else(|error| panic!("{error}"))
}

/// What one life of the board came to.
struct Life {
    /// The period of slot 0 as the console told it at the start.
    found: String,
    /// The save was answered.
    saved: bool,
    stored: Vec<u8>,
    /// Words programmed and sectors erased.
    steps: u64,
    erased: bool,
}

/// Starts with this in the sectors, asks what slot 0 is set to, has these lines carried out, and saves; the power fails in
/// this step.
fn live(stored: &[u8], lines: &[String], cut: Option<u64>) -> Life {
    let mut text = "duration = \"3s\"\n".to_owned() + &typed(60, "show 0");
    for (line, at) in lines.iter().zip((80..).step_by(10)) {
        text += &typed(at, line);
    }
    text += &typed(100 + 10 * lines.len() as u64, "save");
    let scenario = Scenario::parse(Path::new("power"), &text).unwrap_or_else(|error| panic!("{error}"));
    let image = image().with_stored(stored).expect("it fits");
    let mut run = Run::new(&image, &scenario).unwrap_or_else(|error| panic!("{error}"));
    if let Some(step) = cut {
        run.board().cut_power_at(step, step.wrapping_mul(0x9E37_79B9));
    }
    let (mut found, mut saved, mut going) = (None, false, true);
    while going && !saved {
        going = run.go_on_by(20 * MS, |line| {
            let period =
                line.text.split("\"period_ms\":").nth(1).and_then(|rest| rest.split([',', '}']).next());
            found = found.take().or(period.map(str::to_owned));
            saved |= line.text.contains("\"stored\"");
        });
    }
    if cut.is_some() {
        let later = run.now() + SECOND;
        let end = run.board().run_until(later);
        assert!(matches!(end, Err(Stopped::PowerLost { .. })), "the power was cut");
    }
    let stats = run.board().stats();
    Life {
        found: found.expect("the console tells"),
        saved,
        stored: run.board().stored(),
        steps: stats.flash_steps,
        // A step is a word of 16 us, or an erase of half a second.
        erased: stats.stalled_cycles > 168_000 * 400,
    }
}

fn period(period: u32) -> [String; 1] {
    [format!("slot 0 t7 1 -p {period}")]
}

#[test]
fn a_cut_in_any_step_leaves_the_old_configuration_or_the_new_one() {
    let every: u64 = std::env::var("CLINO_EVERY_CUT").map_or(97, |text| text.parse().expect("a number"));
    let mut all: Vec<String> =
        (1..32).map(|slot| format!("slot {slot} t7 {} -p 0 -s 1000", slot + 1)).collect();
    all.extend((32..46).map(|slot| format!("slot {slot} isu {}", slot - 31)));
    all.extend(period(FIRST));
    let mut stored = live(&[], &all, None).stored;
    let (mut cuts, mut old, mut new, mut erases) = (0, 0, 0, 0);
    for number in FIRST + 1..=FIRST + SAVES {
        let whole = live(&stored, &period(number), None);
        assert!(whole.saved);
        assert_eq!(whole.found, (number - 1).to_string(), "what was saved last is in force");
        println!("{} {}", whole.steps, whole.stored.iter().rposition(|b| *b != 255).unwrap());
        erases += u32::from(whole.erased);
        // The first steps and the last, and some between that differ from save to save.
        let picked = |step: &u64| {
            *step <= 2 || *step + 2 > whole.steps || (step + u64::from(number)).is_multiple_of(every)
        };
        for step in (1..=whole.steps).filter(picked) {
            let torn = live(&stored, &period(number), Some(step));
            assert!(!torn.saved, "step {step} of {}", whole.steps);
            let next = live(&torn.stored, &period(99), None);
            match next.found.parse::<u32>() {
                Ok(found) if found == number => new += 1,
                Ok(found) if found == number - 1 => old += 1,
                _ => panic!(
                    "period {} after a cut in step {step} of {} of save {number}",
                    next.found, whole.steps
                ),
            }
            assert!(next.saved, "and it can be saved again");
            cuts += 1;
        }
        stored = whole.stored;
    }
    println!(
        "shipped image: {cuts} cuts, {old} times the old configuration, {new} times the new one, 0 others"
    );
    println!("{SAVES} saves, {erases} erases");
    assert!(erases >= 2, "two compactions");
    assert!(old > 0 && new > 0);
}
