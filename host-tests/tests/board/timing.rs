//! Driver enable and turnaround, measured on the wire.

use clino_board::analysis::Poll;
use clino_host_tests::{Ran, run};

/// Frames over which the driver-enable figures have to hold.
const FRAMES: usize = 10_000;

/// One T7 that answers quickly, asked as often as the bus can: 800 frames a second.
const MANY_FRAMES: &str = r#"
seed = 1
duration = "14s"
t7 = [{ address = 1, motion.constant = 1.0, latency = "200us" }]
isu = [{ address = 1, motion.constant = 1.0 }]
typed = [
    { at = "20ms", line = "slot 0 t7 1 -p 0 -s 1000" },
    { at = "30ms", line = "slot 1 off" },
    { at = "40ms", line = "slot 2 off" },
    { at = "50ms", line = "slot 3 isu 1 -p 0 -s 1000" },
]
"#;

fn assert_driver_enable(polls: &[Poll]) {
    for poll in polls {
        let lead = poll.lead_bits();
        assert!((0.0..=1.0).contains(&lead), "DE to start bit: {lead} bit times in {poll:?}");
        // The last frame may still be on its way when the run ends.
        let Some(tail) = poll.tail() else { continue };
        assert!((0..=5_000).contains(&tail), "stop bit to DE low: {tail} ns in {poll:?}");
    }
}

#[test]
fn driver_enable_frames_ten_thousand_requests() {
    let ran = run(MANY_FRAMES);
    assert!(ran.t7.polls.len() >= FRAMES, "only {} frames", ran.t7.polls.len());
    assert!(ran.isu.polls.len() >= 150, "only {} frames", ran.isu.polls.len());
    assert_driver_enable(&ran.t7.polls);
    assert_driver_enable(&ran.isu.polls);
    assert_eq!((ran.t7.broken_characters, ran.t7.malformed_requests, ran.t7.idle_de), (0, 0, 0));
    let (lead, tail) = (ran.t7.lead_bits.expect("frames"), ran.t7.tail.expect("frames"));
    println!(
        "{} frames: DE to start bit {:.3} to {:.3} bit times, stop bit to DE low {} to {} ns",
        ran.t7.polls.len(),
        lead.min,
        lead.max,
        tail.min,
        tail.max
    );
}

/// Three T7s, due at the same instants, so that one answer is followed by the next request at once.
fn three_in_a_row(latency: &str) -> Ran {
    run(&format!(
        r#"
        duration = "3s"
        t7 = [
            {{ address = 1, motion.constant = 1.0, latency = "{latency}" }},
            {{ address = 2, motion.constant = 2.0, latency = "{latency}" }},
            {{ address = 3, motion.constant = 3.0, latency = "{latency}" }},
        ]
        "#
    ))
}

#[test]
fn the_next_request_follows_the_guard_by_30_us_at_most() {
    /// One character at 115200 bit/s, in nanoseconds.
    const GUARD: i64 = 86_806;
    let ran = three_in_a_row("2ms");
    let back_to_back: Vec<i64> =
        ran.t7.polls.iter().filter_map(Poll::turnaround).filter(|&t| t < 1_000_000).collect();
    assert!(back_to_back.len() >= 290, "{} of 450 polls follow each other", back_to_back.len());
    for &turnaround in &back_to_back {
        assert!((GUARD..=GUARD + 30_000).contains(&turnaround), "{turnaround} ns");
    }
    println!("turnaround {:?} to {:?} ns", back_to_back.iter().min(), back_to_back.iter().max());
}

#[test]
fn an_answer_that_comes_at_once_is_heard_whole() {
    // The shortest latency at which the answer does not begin while DE is still high.
    let ran = three_in_a_row("20us");
    assert_eq!(ran.t7.total().good, ran.t7.total().polls, "{}", ran.summary);
    assert!(ran.t7.total().polls >= 449);
}

#[test]
fn no_request_is_sent_into_an_answer() {
    let ran = three_in_a_row("2ms");
    assert_eq!(ran.t7.contentions, (0, 0));
    assert_eq!(ran.t7.total().good, ran.t7.total().polls);
}
