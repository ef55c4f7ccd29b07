//! The power fails while the shipped image stores its configuration: at every step of saves that fill and erase sectors,
//! the next start finds the old configuration or the new one.

use std::path::Path;

use clino_board::Stopped;
use clino_board::elf::Image;
use clino_board::run::Run;
use clino_board::scenario::Scenario;

use crate::{MS, SECOND};

fn image() -> Image {
    let elf = std::env::var_os("CLINO_ELF")
        .expect("CLINO_ELF names the firmware image: run these tests with `cargo xtask test`");
    Image::read(Path::new(&elf)).unwrap_or_else(|error| panic!("{error}"))
}

/// What one life of the board came to.
struct Life {
    /// The period of slot 0, in ms, as the console told it at the start.
    period: String,
    /// The answer to the save, if it came.
    saved: bool,
    stored: Vec<u8>,
    steps: u64,
    is_cut: bool,
}

/// Starts with this in the sectors, asks what slot 0 is set to, sets another period, and saves; the power fails in this step.
fn live(stored: &[u8], period: u32, cut: Option<u64>) -> Life {
    let text = format!(
        "duration = \"2s\"\n\
         typed = [{{ at = \"60ms\", line = \"show 0\" }}, {{ at = \"80ms\", line = \"slot 0 t7 1 -p {period}\" }}, \
                  {{ at = \"100ms\", line = \"save\" }}]\n"
    );
    let scenario = Scenario::parse(Path::new("power"), &text).unwrap_or_else(|error| panic!("{error}"));
    let image = image().with_stored(stored).expect("it fits");
    let mut run = Run::new(&image, &scenario).unwrap_or_else(|error| panic!("{error}"));
    if let Some(step) = cut {
        run.board().cut_power_at(step, step.wrapping_mul(0x9E37_79B9));
    }
    let (mut shown, mut saved) = (None, false);
    let mut going = true;
    while going && !saved {
        going = run.go_on_by(20 * MS, |line| {
            if line.text.contains("\"period_ms\"") {
                let value =
                    line.text.split("\"period_ms\":").nth(1).and_then(|rest| rest.split([',', '}']).next());
                shown = shown.take().or(value.map(str::to_owned));
            }
            saved |= line.text.contains("\"stored\"");
        });
    }
    let is_cut = cut.is_some() && !saved;
    if is_cut {
        let later = run.now() + SECOND;
        let why = run.board().run_until(later);
        assert!(matches!(why, Err(Stopped::PowerLost { .. })) || !going, "the power was cut");
    }
    let steps = run.board().stats().flash_steps;
    Life { period: shown.expect("the console tells"), saved, stored: run.board().stored(), steps, is_cut }
}

#[test]
fn a_cut_at_any_step_leaves_the_old_configuration_or_the_new_one() {
    // Two generations, to have something old in the flash; then as many saves as make two compactions.
    let mut stored = live(&[], 101, None).stored;
    let (mut cuts, mut old, mut new) = (0, 0, 0);
    let every: u64 = std::env::var("CLINO_EVERY_CUT").map_or(7, |_| 1);
    let mut erases = 0;
    for period in 102..200u32 {
        let whole = live(&stored, period, None);
        assert!(whole.saved);
        assert_eq!(whole.period, (period - 1).to_string(), "what was saved last is in force");
        // Steps differ from save to save: the first, the last, and some between.
        let steps = whole.steps;
        let picked = (1..=steps)
            .filter(|step| *step <= 2 || *step > steps - 2 || (step + u64::from(period)) % (every * 9) == 0);
        for step in picked {
            let torn = live(&stored, period, Some(step));
            assert!(torn.is_cut, "step {step} of {steps}");
            let next = live(&torn.stored, 200, None);
            match next.period.parse::<u32>() {
                Ok(found) if found == period => new += 1,
                Ok(found) if found == period - 1 => old += 1,
                _ => panic!("period {} after a cut in step {step} of {steps} of save {period}", next.period),
            }
            assert!(next.saved, "and it can be saved again");
            cuts += 1;
        }
        erases += u32::from(whole.stored.len() != stored.len() || erased(&stored, &whole.stored));
        stored = whole.stored;
        if erases >= 3 && period > 110 {
            break;
        }
    }
    println!(
        "shipped image: {cuts} cuts, {old} times the old configuration, {new} times the new one, {erases} erases"
    );
    assert!(erases >= 2, "two compactions");
    assert!(old > 0 && new > 0);
}

/// Some byte has got a bit back that only an erase gives.
fn erased(before: &[u8], after: &[u8]) -> bool {
    before.iter().zip(after).any(|(before, after)| !before & after != 0)
}
