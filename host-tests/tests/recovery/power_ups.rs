//! Power-ups are counted in flash: no two starts of a board have the same two numbers, whatever was between them.

use std::path::Path;

use clino_board::BoardModel;
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::{image, model};

use crate::{MS, SECOND, typed};

/// The last sector: 11 of 1 MiB, 7 of 512 KiB (RM0090 table 5, RM0390 table 5).
fn tally() -> u32 {
    match model() {
        BoardModel::F407Disc1 => 0x080E_0000,
        BoardModel::F407Ve | BoardModel::NucleoF446re => 0x0806_0000,
    }
}
/// Its words.
const WORDS: u32 = 32 * 1024;

/// The board is powered up with this in the first words of the sector, and is started again once without a loss of power.
/// Returns power-ups and boots of both starts, and the words afterwards.
fn life(words: &[u32]) -> (Vec<(u64, u64)>, Vec<u32>) {
    let text = "duration = \"2s\"\n".to_owned() + &typed(300, "reboot --yes");
    let scenario = Scenario::parse(Path::new("power_ups"), &text).unwrap_or_else(|error| panic!("{error}"));
    let contents: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let image = image().clone().with_flash(tally(), &contents);
    let image = image.unwrap_or_else(|error| panic!("{error}"));
    let mut run = Run::new(&image, &scenario).unwrap_or_else(|error| panic!("{error}"));
    let mut starts = Vec::new();
    while run.now() < SECOND {
        run.go_on_by(20 * MS, |line| {
            let object: Option<serde_json::Value> = serde_json::from_str(&line.text).ok();
            if let Some(object) = object.filter(|object| object.get("stream").is_some()) {
                let number = |key: &str| object[key].as_u64().expect("a number");
                starts.push((number("power_ups"), number("boots")));
            }
        });
    }
    let after = (0..(words.len() as u32 + 1).min(WORDS))
        .map(|word| run.board().peek32(tally() + 4 * word).expect("flash"));
    (starts, after.collect())
}

#[test]
fn a_power_up_is_counted_once_and_a_reset_is_not() {
    let (starts, words) = life(&[]);
    assert_eq!((starts, words), (vec![(1, 1), (1, 2)], vec![0xFFFF_FFFE]), "a new board");
    let (starts, words) = life(&[0xFFFF_FFFE]);
    assert_eq!((starts, &words[..]), (vec![(2, 1), (2, 2)], &[0xFFFF_FFFC, u32::MAX][..]));
    // Over the end of a word, and behind one whose programming was cut off.
    let (starts, words) = life(&[0, 0x8000_0000]);
    assert_eq!((starts, &words[..]), (vec![(64, 1), (64, 2)], &[0, 0, u32::MAX][..]));
    let (starts, words) = life(&[0, 0xFFF5_0000]);
    assert_eq!((starts, &words[..]), (vec![(65, 1), (65, 2)], &[0, 0xFFF5_0000, 0xFFFF_FFFE][..]));
}

#[test]
fn a_full_tally_stays_at_its_end_and_the_board_starts() {
    let full = vec![0; WORDS as usize - 1];
    let (starts, words) = life(&[&full[..], &[0x8000_0000]].concat());
    assert_eq!(starts, [(1 << 20, 1), (1 << 20, 2)]);
    assert_eq!(words[WORDS as usize - 1], 0);
    let (starts, _) = life(&vec![0; WORDS as usize]);
    assert_eq!(starts, [(1 << 20, 1), (1 << 20, 2)]);
}
