//! The flash driver and the store of the firmware on the virtual board, which knows the flash controller: the power is cut
//! while words are programmed and sectors erased, and afterwards there is the old configuration or the new one.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use clino_board::elf::Image;
use clino_board::{Board, BoardModel, CpuStats, Ports, Stopped};

const MS: u64 = 1_000_000;
/// Longer than the longest erase, and what is computed around it.
const LONG_ENOUGH: u64 = 1_500 * MS;
/// Core clock, Hz.
const CORE_HZ: u64 = 168_000_000;
/// A sector of 16 KiB is erased within this (DS8626 table 40, maximum).
const ERASE: u64 = 500 * MS;

/// Saves that fill a sector with the long configurations of this firmware.
const PER_SECTOR: u32 = 4;

/// The firmware, built once.
fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let crate_dir = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("storage-firmware");
        // The workspace's own, `CARGO_TARGET_TMPDIR` is below it: what other firmware has built there is not built again.
        let target_dir = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("a folder");
        let status = Command::new(env!("CARGO"))
            .current_dir(&crate_dir)
            .args(["build", "--release", "--target", "thumbv7em-none-eabihf", "--target-dir"])
            .arg(target_dir)
            .status()
            .expect("cargo runs");
        assert!(status.success(), "the firmware does not build: is the thumb target installed?");
        Image::read(&target_dir.join("thumbv7em-none-eabihf/release/storage-firmware"), BoardModel::default())
            .expect("an image")
    })
}

/// What one power-up came to.
#[derive(Debug)]
struct Boot {
    found: u32,
    number: u32,
    saved: u32,
    saved_again: u32,
    erases: u32,
    load_ns: u64,
    save_ns: u64,
    stats: CpuStats,
    power_lost: bool,
    stored: Vec<u8>,
}

impl Boot {
    /// The number of the configuration that was found; 0 is none.
    fn configuration(&self) -> u32 {
        assert!(matches!((self.found, self.number), (0, 0) | (1, 1..)), "{} {}", self.found, self.number);
        self.number
    }
}

/// Powers the board up with this in its sectors, and cuts the power at a step with a seed.
fn boot(stored: &[u8], cut: Option<(u64, u64)>) -> Boot {
    let image = image().clone().with_stored(stored).expect("it fits");
    let mut board = Board::new(&image, Ports::open()).expect("a board");
    if let Some((step, seed)) = cut {
        board.cut_power_at(step, seed);
    }
    let base = image.symbol("RESULTS").expect("the results' symbol");
    let mut power_lost = false;
    for until in (10 * MS..LONG_ENOUGH).step_by(10 * MS as usize) {
        match board.run_until(until) {
            Ok(()) if board.peek32(base) == Some(2) => break,
            Ok(()) => {}
            Err(Stopped::PowerLost { .. }) => {
                power_lost = true;
                break;
            }
            Err(stopped) => panic!("{stopped}"),
        }
    }
    let [stage, found, number, saved, saved_again, erases, load, save] =
        std::array::from_fn(|slot| board.peek32(base + 4 * slot as u32).expect("RAM"));
    assert!(power_lost || stage == 2, "stage {stage} after {} ns", board.now());
    let ns = |cycles: u32| u64::from(cycles) * 1_000_000_000 / CORE_HZ;
    Boot {
        found,
        number,
        saved,
        saved_again,
        erases,
        load_ns: ns(load),
        save_ns: ns(save),
        stats: board.stats(),
        power_lost,
        stored: board.stored(),
    }
}

#[test]
fn each_power_up_finds_what_the_last_one_saved() {
    let mut stored = Vec::new();
    let (mut slowest, mut busiest) = (0, 0);
    for number in 0..4 * PER_SECTOR {
        let boot = boot(&stored, None);
        assert_eq!(boot.configuration(), number);
        // The same again is no step of the flash: the sum of all is that of the first save.
        assert_eq!((boot.saved, boot.saved_again), (1, 2));
        // A sector is erased when the first record goes into it.
        assert_eq!(boot.erases, u32::from(number % PER_SECTOR == 0), "save {number}");
        let erasing = u64::from(boot.erases) * ERASE;
        assert!(boot.save_ns >= erasing && boot.save_ns < erasing + 100 * MS, "{} ns", boot.save_ns);
        assert!(boot.stats.stalled_cycles * 10 > erasing / 1_000_000 * 168_000 * 9);
        slowest = slowest.max(boot.load_ns);
        busiest = busiest.max(boot.save_ns - erasing);
        stored = boot.stored;
    }
    let [slowest, busiest] = [slowest, busiest].map(|ns| ns as f64 / 1e6);
    println!("slowest load {slowest:.1} ms, slowest save but for erasing {busiest:.1} ms");
}

/// Cuts the save of each of these configurations at some of its steps.
fn cut(saves: impl Fn(u32) -> bool, steps: impl Fn(u64) -> Vec<u64>) {
    let (mut stored, mut points, mut taken) = (Vec::new(), 0, 0);
    for number in 0..=4 * PER_SECTOR {
        let whole = boot(&stored, None);
        assert_eq!(whole.configuration(), number);
        let all = whole.stats.flash_steps;
        for step in if saves(number) { steps(all) } else { Vec::new() } {
            let torn = boot(&stored, Some((step, u64::from(number) << 32 | step)));
            assert!(torn.power_lost, "save {number}, step {step} of {all}");
            let next = boot(&torn.stored, None);
            let found = next.configuration();
            assert!(found == number || found == number + 1, "save {number}, step {step}: {found}");
            // It serves as before.
            assert_eq!(next.saved, 1, "save {number}, step {step}");
            assert_eq!(boot(&next.stored, None).configuration(), found + 1);
            points += 1;
            taken += u32::from(found > number);
        }
        stored = whole.stored;
    }
    println!("{points} cuts on the board: {} old, {taken} new, 0 failures", points - taken);
    assert!(points > 0);
}

/// The first save, the first into each sector, and one in between; the steps at both ends of each.
#[test]
fn old_or_new_wherever_the_power_is_cut() {
    cut(|number| number % PER_SECTOR == 0 || number == 4, |all| [1, 3, all / 2, all - 1, all].to_vec());
}

/// Every save, every step.
#[test]
#[ignore = "hours"]
fn campaign() {
    cut(|_| true, |all| (1..=all).collect());
}
