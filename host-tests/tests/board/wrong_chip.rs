//! The image in the flash of another board: it says on the console that it is not for this chip, and does nothing else.

use std::path::Path;

use clino_board::BoardModel;
use clino_board::run::Run;
use clino_board::scenario::Scenario;
use clino_host_tests::{image, model};

const SECOND: u64 = 1_000_000_000;

/// Device number (RM0090 section 38.6.1, RM0390 section 33.6.1) and KiB of flash, as the image prints them.
fn chip(model: BoardModel) -> (&'static str, u32) {
    match model {
        BoardModel::F407Disc1 => ("413", 0x400),
        BoardModel::F407Ve => ("413", 0x200),
        BoardModel::NucleoF446re => ("421", 0x200),
    }
}

#[test]
fn the_image_says_so_and_does_nothing_on_another_chip() {
    let (own_device, own_kb) = chip(model());
    let mut refusals = 0;
    for other in BoardModel::ALL {
        let (device, kb) = chip(other);
        let scenario = "duration = \"5s\"\nt7 = [{ address = 1, motion.constant = 1.0 }]\n";
        let scenario =
            Scenario::parse(Path::new("wrong chip"), scenario).unwrap_or_else(|error| panic!("{error}"));
        let image = image().clone().put_into(other);
        let mut run = Run::new(&image, &scenario).unwrap_or_else(|error| panic!("{error}"));
        let mut lines = Vec::new();
        run.finish(|line| lines.push(line.clone()));
        if device == own_device && kb >= own_kb {
            assert!(lines.iter().any(|line| line.text.starts_with('{')), "{other}: {lines:?}");
            continue;
        }
        refusals += 1;
        let words = format!("This chip is device 0x{device} with 0x{kb:03x} KiB: nothing runs.");
        let said: Vec<_> = lines.iter().filter(|line| !line.text.is_empty()).collect();
        assert!(said.iter().all(|line| line.text.ends_with(&words)), "{other}: {said:?}");
        assert!(said.iter().all(|line| line.text.starts_with("clino: this image is for an ")), "{said:?}");
        assert!((3..=15).contains(&said.len()) && said[0].at < SECOND, "{other}: {said:?}");
        // PA2 alone is an alternate function, 7 (RM0090 section 8.4); the other ports have no clock, so nothing sets them.
        let mut peek = |address| run.board().peek32(address).expect("a register");
        assert_eq!([0x4002_0000, 0x4002_0020].map(&mut peek), [0xa800_0020, 0x0000_0700], "port A");
        // The core stays on the internal oscillator; only GPIOA and USART2 have a clock.
        assert_eq!(peek(0x4002_3808), 0, "RCC_CFGR");
        assert_eq!(peek(0x4002_3830) & 0xff, 1, "RCC_AHB1ENR");
        assert_eq!(peek(0x4002_3840), 1 << 17, "RCC_APB1ENR");
        assert_eq!(peek(0x4002_3844), 0, "RCC_APB2ENR");
        let stats = run.board().stats();
        assert_eq!((stats.resets, stats.flash_steps), (0, 0), "{other}");
        assert!(run.analyses().iter().all(|(_, bus)| bus.polls.is_empty()), "{other}: no sensor is asked");
    }
    assert!(refusals > 0, "every other board has the same chip: this shows nothing");
}
