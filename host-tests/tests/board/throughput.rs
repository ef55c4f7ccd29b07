//! How often T7s can be read: the wire decides, not the gateway.

use std::fmt::Write as _;

use clino_board::analysis::Poll;
use clino_host_tests::{Ran, run};

const SECOND: u64 = 1_000_000_000;

/// Three characters of request, 2 ms, eight of answer, at 115200 bit/s, ten bits each, in seconds.
const POLL: f64 = 0.002 + 110.0 / 115_200.0;

/// `nodes` T7s that take the 2 ms they may, all asked as often as the bus can. `setup` is typed before.
fn as_fast_as_possible(nodes: u8, setup: &[&str], hold: &str) -> Ran {
    let mut scenario = String::from("seed = 1\nduration = \"3s\"\n");
    for address in 1..=nodes {
        let node = format!(
            "address = {address}\nmotion.constant = {address}.5\nlatency = \"2ms\"\nhold = \"{hold}\"\n"
        );
        write!(scenario, "[[t7]]\n{node}").expect("text");
    }
    let slots = (0..nodes.max(6)).map(|slot| match slot < nodes {
        true => format!("slot {slot} t7 {} -p 0 -s 1000", slot + 1),
        false => format!("slot {slot} off"),
    });
    let lines = setup.iter().map(|&line| line.to_owned()).chain(slots);
    for (number, line) in lines.enumerate() {
        write!(scenario, "[[typed]]\nat = \"{}ms\"\nline = \"{line}\"\n", 20 + 10 * number).expect("text");
    }
    let ran = run(&scenario);
    // While an exchange is in hand, a change of the bus is accepted first.
    let taken = [r#"{"done":true}"#, r#"{"accepted":true}"#];
    let done = ran.lines.iter().filter(|line| taken.contains(&line.text.as_str())).count();
    assert_eq!(done, setup.len() + usize::from(nodes.max(6)), "every line typed was carried out");
    ran
}

/// Polls a second, from the first to the third second, all of them good.
fn rate(ran: &Ran) -> f64 {
    let within = |poll: &&Poll| (SECOND..3 * SECOND).contains(&poll.de_high);
    let polls = ran.t7.polls.iter().filter(within).count();
    let total = ran.t7.total();
    // Addresses 2 and 3 are asked until their slots are switched off.
    assert!(total.bad_answer + total.device_error == 0 && total.no_answer < 20, "{}", ran.summary);
    polls as f64 / 2.0
}

fn assert_rate(nodes: u8, setup: &[&str], hold: &str, part: f64) {
    let ran = as_fast_as_possible(nodes, setup, hold);
    let (rate, limit) = (rate(&ran), 1.0 / POLL);
    println!("{nodes} nodes, {setup:?}: {rate:.1} polls/s, {:.2} % of {limit:.1}", 100.0 * rate / limit);
    assert!(rate >= part * limit, "{rate} of {limit} polls a second");
    for address in 1..=nodes {
        let truth = f64::from(address) + 0.5;
        let last = ran.slot(u32::from(address) - 1).last().expect("every node was read");
        assert_eq!(last.reading.angle_deg, Some(truth), "{last:?}");
    }
}

#[test]
fn with_the_default_guard_96_percent_of_what_the_wire_bears() {
    for nodes in [1, 8, 32] {
        assert_rate(nodes, &[], "40us", 0.96);
    }
}

#[test]
fn without_a_guard_98_and_a_half_percent_of_what_the_wire_bears() {
    // Without a guard the sensors have to let go of the line at once.
    for nodes in [1, 8, 32] {
        assert_rate(nodes, &["bus t7 -g 0"], "0us", 0.985);
    }
}
