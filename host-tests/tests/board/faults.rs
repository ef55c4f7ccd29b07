//! Dead nodes, corrupted answers, noise: never a wrong angle, never a stuck slot.

use clino_host_tests::run;

#[test]
fn a_dead_node_costs_two_and_a_half_milliseconds_and_is_said_to_be_dead() {
    let ran = run(r#"
        duration = "2s"
        t7 = [{ address = 1, motion.constant = 10.0 }, { address = 3, motion.constant = 30.0 }]
        "#);
    assert!(ran.slot(1).count() >= 10);
    assert!(ran.slot(1).all(|spoken| spoken.reading.status == "no_answer"));
    // From a request to the dead node to the next one: 2.6 ms at most.
    for pair in ran.t7.polls.windows(2) {
        if pair[0].request[0] == 2 && pair[1].request[0] == 2 {
            let cost = pair[1].de_high - pair[0].de_high;
            assert!(cost <= 2_600_000 || cost > 10_000_000, "{cost} ns");
        }
    }
    assert!(ran.slot(0).chain(ran.slot(2)).all(|spoken| spoken.is_ok()));
}

#[test]
fn a_corrupted_answer_is_repeated_and_never_believed() {
    let ran = run(r#"
        seed = 11
        duration = "3s"
        t7 = [
            { address = 1, motion.constant = 10.0, fault = { every = 2, what = "bad_checksum" } },
            { address = 2, motion.constant = 20.0, fault = { every = 1, what = "bad_checksum" } },
            { address = 3, motion.constant = 30.0 },
        ]
        "#);
    // Every other answer is bad: the retry gets the good one, and the slot never stops being ok.
    assert!(ran.slot(0).all(|spoken| spoken.reading.angle_deg == Some(10.0)));
    assert!(ran.t7.by_address[&1].bad_answer >= 70, "{:?}", ran.t7.by_address[&1]);
    // Every answer is bad: no angle, and the reason.
    let statuses: Vec<&str> = ran.slot(1).map(|spoken| spoken.reading.status.as_str()).collect();
    assert!(statuses.len() >= 20);
    assert!(statuses.iter().all(|&status| status == "bad_answer"), "{statuses:?}");
    assert!(ran.slot(2).all(|spoken| spoken.is_ok()));
}

#[test]
fn an_isu_with_a_bad_checksum_is_never_believed() {
    let ran = run(r#"
        duration = "3s"
        isu = [{ address = 1, motion.constant = 100.0, fault = { every = 1, what = "bad_checksum" } }]
        "#);
    assert!(ran.slot(3).count() >= 5);
    assert!(ran.slot(3).all(|spoken| spoken.reading.status == "bad_answer"));
}

#[test]
fn answers_that_come_too_late_are_never_used() {
    // A node that has answered before is waited for, so that its late answer meets no other request: a collision would
    // keep the other T7s waiting for the rest of a frame for up to 500 ms (T7 guide, section 1).
    let ran = run(r#"
        duration = "5s"
        t7 = [
            { address = 1, motion.constant = 10.0, fault = { every = 3, what.late = "3ms" } },
            { address = 2, motion.constant = 20.0 },
            { address = 3, motion.constant = 30.0 },
        ]
        "#);
    assert_eq!(ran.t7.contentions, (0, 0));
    for undisturbed in [2, 3] {
        let tally = ran.t7.by_address[&undisturbed];
        assert!(tally.good == tally.polls && tally.polls >= 249, "{undisturbed}: {tally:?}");
    }
    // One answer in three was late, was asked for again, and was counted.
    let counted = ran
        .lines
        .iter()
        .rev()
        .find_map(|line| line.text.split_once(r#""stats":"t7""#)?.1.split_once(r#""late":"#));
    let late: u32 =
        counted.and_then(|(_, rest)| rest.trim_end_matches('}').parse().ok()).expect("the counter is there");
    assert!((80..=130).contains(&late), "{late}");
    for (slot, truth) in [(0, 10.0), (1, 20.0), (2, 30.0)] {
        for spoken in ran.slot(slot).filter(|spoken| spoken.is_ok()) {
            assert_eq!(spoken.reading.angle_deg, Some(truth), "slot {slot}");
        }
        assert!(ran.slot(slot).any(|spoken| spoken.is_ok()), "slot {slot}");
    }
}

#[test]
fn a_babbling_node_stops_no_poll_for_longer_than_it_babbles() {
    let ran = run(r#"
        seed = 3
        duration = "4s"
        t7 = [
            { address = 1, motion.constant = 10.0 },
            { address = 2, motion.constant = 20.0 },
            { address = 3, motion.constant = 30.0, babble = [{ from = "1s", until = "1.5s" }] },
        ]
        isu = [{ address = 1, motion.constant = 40.0 }]
        "#);
    const SECOND: u64 = 1_000_000_000;
    assert!(ran.all_well, "{}", ran.summary);
    // Frames cut short by the babble may keep a T7 deaf as long as any node transmits (T7 guide, section 1): one second
    // without an answer, then 520 ms of silence for all, then a reading and the one that confirms it.
    for slot in [0, 1] {
        let back = ran.slot(slot).find(|spoken| spoken.began > 3 * SECOND / 2 && spoken.is_ok());
        assert!(back.is_some_and(|spoken| spoken.at < 11 * SECOND / 4), "slot {slot}: {back:?}");
        assert!(
            !ran.slot(slot)
                .any(|spoken| spoken.is_ok() && (11 * SECOND / 10..14 * SECOND / 10).contains(&spoken.began))
        );
    }
    // The other bus does not notice.
    assert!(ran.slot(3).all(|spoken| spoken.is_ok()));
}

#[test]
fn heavy_noise_on_both_buses_never_makes_a_wrong_angle() {
    // A T7 that noise has made deaf may stay so until it is taken for dead, a second, and until the next silence of its bus,
    // five; that lasts half a second, and a dead node is asked once a second. The last readings have to be good, so the noise
    // ends before. With this seed the gateway itself hears too few line errors to keep a silence when T7 3 dies; it keeps one
    // five seconds later.
    let ran = run(r#"
        seed = 99
        duration = "18s"
        segments.t7.noise = { bit_error_rate = 1e-4, drop_rate = 1e-4, within = { from = "0s", until = "7s" } }
        segments.isu.noise = { bit_error_rate = 1e-3, drop_rate = 1e-3, within = { from = "0s", until = "7s" } }
        t7 = [
            { address = 1, motion.constant = 10.0 },
            { address = 2, motion.constant = -170.0 },
            { address = 3, motion.ramp.rate = 20.0 },
        ]
        isu = [{ address = 1, motion.constant = 200.0 }]
        "#);
    assert!(ran.all_well, "{}", ran.summary);
    let total = ran.t7.total();
    assert!(total.bad_answer + total.no_answer >= 20, "the noise must have hit: {total:?}");
}
