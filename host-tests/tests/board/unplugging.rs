//! A node that goes away in the middle of the run, and comes back.

use clino_host_tests::run;

const MS: u64 = 1_000_000;
/// Pulled at 1 s, back at 2 s.
const PULLED: u64 = 1_000 * MS;
const BACK: u64 = 2_000 * MS;
/// A T7 needs 20 ms after power-on in the simulation.
const BOOT: u64 = 20 * MS;
/// Poll period of the T7 slots.
const T7_PERIOD: u64 = 20 * MS;
/// Poll period of the ISU slot.
const ISU_PERIOD: u64 = 266 * MS;
/// A line of 100 characters at 115200 bit/s ahead of ours, and ours.
const CONSOLE: u64 = 18 * MS;

const SCENARIO: &str = r#"
seed = 5
duration = "3.2s"
t7 = [
    { address = 1, motion.constant = 10.0 },
    { address = 2, motion.ramp.rate = 40.0, unplugged = [{ from = "1s", until = "2s" }] },
    { address = 3, motion.constant = 30.0 },
]
isu = [{ address = 1, motion.ramp.rate = 40.0, unplugged = [{ from = "1s", until = "2s" }] }]
"#;

#[test]
fn an_unplugged_t7_reads_no_answer_within_two_polls_and_comes_back() {
    let ran = run(SCENARIO);
    let lost = ran.slot(1).find(|spoken| spoken.began > PULLED && !spoken.is_ok()).expect("it is missed");
    assert_eq!(lost.reading.status, "no_answer");
    assert_eq!(lost.reading.angle_deg, None);
    assert!(lost.at <= PULLED + 2 * T7_PERIOD + CONSOLE, "{} ms late", (lost.at - PULLED) / MS);

    let after = |spoken: &&clino_host_tests::Spoken| spoken.began > PULLED + T7_PERIOD + CONSOLE;
    let stale = ran.slot(1).filter(after).find(|spoken| spoken.is_ok() && spoken.at < BACK);
    assert!(stale.is_none(), "the old angle was repeated: {stale:?}");

    let found = ran.slot(1).find(|spoken| spoken.began > BACK && spoken.is_ok()).expect("it comes back");
    assert!(found.at <= BACK + BOOT + 2 * T7_PERIOD + CONSOLE, "{} ms late", (found.at - BACK) / MS);
    // 80° at 2 s and 40° a second from there on: not the 40° of when it was pulled.
    assert!(found.reading.angle_deg >= Some(79.9), "{found:?}");
    assert!(ran.all_well, "{}", ran.summary);
}

#[test]
fn an_unplugged_t7_does_not_disturb_the_others() {
    let ran = run(SCENARIO);
    for address in [1, 3] {
        let tally = ran.t7.by_address[&address];
        assert_eq!(tally.good, tally.polls, "address {address}");
        // 50 a second for 3.2 s.
        assert!(tally.polls >= 159, "address {address}: {} polls", tally.polls);
    }
    for slot in [0, 2] {
        assert!(ran.slot(slot).all(|spoken| spoken.is_ok()), "slot {slot}");
    }
}

#[test]
fn an_unplugged_isu_reads_no_answer_within_two_polls_and_comes_back() {
    let ran = run(SCENARIO);
    let lost = ran.slot(3).find(|spoken| spoken.began > PULLED && !spoken.is_ok()).expect("it is missed");
    assert_eq!(lost.reading.status, "no_answer");
    assert!(lost.at <= PULLED + 2 * ISU_PERIOD + CONSOLE, "{} ms late", (lost.at - PULLED) / MS);
    let repeated = ran.slot(3).find(|spoken| spoken.is_ok() && spoken.began > lost.at && spoken.at < BACK);
    assert!(repeated.is_none(), "the old angle was repeated: {repeated:?}");
    assert!(ran.slot(3).any(|spoken| spoken.is_ok() && spoken.began > BACK), "it comes back");
}
