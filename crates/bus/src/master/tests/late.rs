//! Answers that come after their deadline.

use super::*;

/// No answer begins later than this after the deadline.
const LATE: u64 = 25_000;

impl Bench {
    /// Asks for axis 2 of `address` as soon as that may be asked, at the earliest at `at`.
    fn ask_node(&mut self, address: u8, at: u64) {
        self.wait_until(at);
        while !self.master.may_ask(node(address), &ANGLE, Instant::from_micros(self.now)) {
            let at = self.master.ask_at(node(address), &ANGLE).or(self.master.poll_at());
            self.wait_until(at.unwrap().as_micros());
        }
        self.outcomes.clear();
        self.master.begin(node(address), &ANGLE, Instant::from_micros(self.now)).unwrap();
        self.released();
    }
}

#[cfg(feature = "many-nodes")]
#[test]
fn the_same_request_waits_for_the_late_answer_to_the_last_one() {
    let mut bench = Bench::asked();
    bench.wait_until(1_000 + DEADLINE);
    let expired = Instant::from_micros(1_000 + DEADLINE + LATE);
    assert_eq!(bench.master.ask_at(node(5), &ANGLE), Some(expired));
    // All of them are asked for that axis, this one too.
    assert_eq!(bench.master.ask_at(Address::ALL, &ANGLE), Some(expired));
    let clear = Instant::from_micros(1_000 + DEADLINE + CHARACTER);
    assert_eq!(bench.master.ask_at(node(6), &ANGLE), Some(clear));
    assert_eq!(bench.master.ask_at(node(5), &Request::GetAngle(Axis::One)), Some(clear));
}

#[test]
fn when_the_late_answer_has_come_the_wait_is_over() {
    let mut bench = Bench::asked();
    bench.hear(1_000 + DEADLINE + 6_000, &ANSWER);
    let end = 1_000 + DEADLINE + 6_000 + 7 * CHARACTER;
    assert_eq!(bench.master.ask_at(node(5), &ANGLE), Some(Instant::from_micros(end)));
    bench.wait_until(end);
    assert!(bench.master.is_idle());
    assert_eq!(bench.master.counters().late, 1);
}

#[cfg(feature = "many-nodes")]
#[test]
fn a_late_answer_in_the_next_nodes_exchange_is_late_and_not_foreign() {
    let mut bench = Bench::asked();
    bench.ask_node(6, 0);
    bench.hear(bench.now + 300, &ANSWER);
    bench.hear(bench.now + 300, &FOREIGN);
    let answer = bench.only_outcome().result.as_ref().unwrap();
    assert_eq!(answer.address.get(), 6);
    let counters = bench.master.counters();
    assert_eq!((counters.late, counters.foreign, counters.good), (1, 0, 1));
    // It has come: the node can be asked again.
    assert!(bench.master.may_ask(node(5), &ANGLE, Instant::from_micros(bench.now)));
}

#[cfg(feature = "many-nodes")]
#[test]
fn a_late_answer_while_the_next_frame_waits_for_silence_is_late() {
    let mut bench = Bench::asked();
    bench.wait_until(1_000 + DEADLINE + CHARACTER);
    bench.outcomes.clear();
    bench.master.begin(node(6), &ANGLE, Instant::from_micros(bench.now)).unwrap();
    bench.hear(bench.now + 10, &ANSWER);
    bench.released();
    bench.hear(bench.now + 2_000, &FOREIGN);
    assert_eq!(bench.only_outcome().result.as_ref().unwrap().address.get(), 6);
    assert_eq!(bench.master.counters().late, 1);
}

#[test]
fn a_late_answer_is_never_that_of_an_impatient_repetition() {
    for lateness in (100..LATE).step_by(490) {
        let mut bench = Bench::asked();
        let begins = 1_000 + 2_000 + lateness;
        let mut asked_at = 1_000 + DEADLINE + CHARACTER;
        let mut answered = false;
        // The caller repeats at once, again and again, in spite of what the master says.
        while asked_at < begins + 5_000 {
            bench.wait_until(asked_at);
            if !bench.master.is_asking() {
                bench.ask();
            }
            if !answered && bench.now + 2_000 >= begins {
                bench.hear(begins.max(bench.now) + CHARACTER, &ANSWER);
                answered = true;
            }
            asked_at = bench.now + 500;
        }
        assert!(answered && bench.outcomes.iter().all(|outcome| outcome.result.is_err()), "{lateness}");
    }
}

#[test]
fn a_patient_repetition_gets_its_own_answer_however_late_the_first_one_is() {
    for lateness in (100..LATE + 2_000).step_by(97) {
        let mut bench = Bench::asked();
        // The first answer comes late by so much; the second one, to whatever is asked, at once.
        let begins = 1_000 + 2_000 + lateness;
        if begins < 1_000 + DEADLINE + LATE {
            bench.hear(begins + CHARACTER, &ANSWER);
        }
        bench.ask_node(5, 0);
        let mut second = ANSWER;
        // 0.045° less: FFFF4EFF becomes FFFF4ED2.
        (second[6], second[7]) = (0xD2, 0x54);
        bench.hear(bench.now + 1_000, &second);
        let answer = bench.only_outcome().result.as_ref().unwrap();
        assert_eq!(
            answer.response,
            Response::GetAngle { axis: Axis::Two, angle: Millidegrees(-45_358) },
            "{lateness}"
        );
    }
}

#[test]
fn an_answer_that_came_damaged_is_not_waited_for() {
    let mut bench = Bench::asked();
    let mut damaged = ANSWER;
    damaged[7] ^= 1;
    bench.hear(2_000, &damaged);
    bench.wait_until(6_000);
    assert!(matches!(bench.fault(), Fault::Bad(DecodeError::Checksum { .. })));
    assert!(bench.master.may_ask(node(5), &ANGLE, Instant::from_micros(bench.now)));
    assert!(bench.master.is_idle());
}

#[cfg(feature = "many-nodes")]
#[test]
fn replies_of_many_dead_nodes_are_outstanding_together() {
    let mut bench = Bench::asked();
    let begin = bench.now;
    for address in 6..=14 {
        bench.ask_node(address, 0);
    }
    // Nine requests of 300, 2174 and 87 µs: the first reply is still outstanding.
    assert!(bench.now - begin < LATE);
    for address in 5..=14 {
        let at = bench.master.ask_at(node(address), &ANGLE);
        assert!(at.is_none_or(|at| at > Instant::from_micros(bench.now)), "{address}");
    }
    // A late answer of the first one is known for what it is.
    let late = bench.master.counters().late;
    bench.hear(bench.now + 200, &ANSWER);
    assert_eq!(bench.master.counters().late, late + 1);
}

#[cfg(feature = "many-nodes")]
#[test]
fn with_too_many_replies_outstanding_the_next_request_waits() {
    // A caller whose timing makes dead nodes cheaper than the list is made for.
    let timing = Timing {
        get_latency: Duration::from_micros(100),
        quiet: Duration::from_micros(0),
        ..Timing::t7(crate::Serial::T7_DEFAULT)
    };
    let mut bench = Bench { master: Master::new(timing), now: 0, outcomes: Vec::new() };
    let mut asked = Vec::new();
    for address in 1..=30 {
        bench.ask_node(address, 0);
        asked.push(bench.now);
    }
    // Twelve on the list and one in hand, then one has to go before one can come.
    for (earlier, later) in asked.iter().zip(&asked[13..]) {
        assert!(later - earlier >= LATE, "{asked:?}");
    }
    assert!(asked[12] - asked[0] < LATE);
}

#[test]
fn a_node_that_is_a_little_slow_is_waited_for_from_then_on() {
    let mut bench = Bench::asked();
    // 3 ms instead of 2.
    bench.hear(1_000 + 3_000 + CHARACTER, &ANSWER);
    assert_eq!(bench.master.counters().late, 1);
    bench.ask_node(5, 0);
    bench.hear(bench.now + 3_000 + CHARACTER, &ANSWER);
    assert!(bench.is_the_answer());
    // As long as it goes on like this, so does the master.
    for _ in 0..2_500 {
        bench.ask_node(5, 0);
        bench.hear(bench.now + 3_000 + CHARACTER, &ANSWER);
        assert!(bench.is_the_answer());
    }
    // And no longer: after two windows of 1000 requests silence is as cheap as ever.
    for _ in 0..2_000 {
        bench.ask_node(5, 0);
        bench.hear(bench.now + 1_000, &ANSWER);
    }
    bench.ask_node(5, 0);
    bench.wait_until(bench.now + 10_000);
    assert_eq!(*bench.fault(), Fault::NoAnswer { waited: Duration::from_micros(DEADLINE as u32) });
}

#[test]
fn the_wait_grows_by_the_extension_at_most() {
    let mut bench = Bench::asked();
    // An extension of 2 ms is not enough for this one: nothing changes.
    bench.hear(1_000 + 4_500, &ANSWER);
    assert_eq!(bench.master.counters().late, 1);
    bench.ask_node(6, 0);
    bench.wait_until(bench.now + 10_000);
    assert_eq!(*bench.fault(), Fault::NoAnswer { waited: Duration::from_micros(DEADLINE as u32) });
}

#[cfg(not(feature = "many-nodes"))]
mod without_a_list {
    use super::*;

    #[test]
    fn every_request_waits_for_the_late_answer_to_the_last_one() {
        let mut bench = Bench::asked();
        bench.wait_until(1_000 + DEADLINE);
        let expired = Some(Instant::from_micros(1_000 + DEADLINE + LATE));
        for request in [ANGLE, Request::GetAngle(Axis::One), Request::GetDamping] {
            for address in [node(5), node(6), Address::ALL] {
                assert_eq!(bench.master.ask_at(address, &request), expired);
            }
        }
        assert_eq!(bench.master.poll_at(), expired, "idle from then on");
    }

    /// Of three requests that were given up, the answers come late during a fourth, in any order; its own comes with them.
    #[test]
    fn a_request_that_is_sent_too_early_is_never_answered() {
        let answers: Vec<[u8; 8]> = (5..=8_u8)
            .map(|address| {
                let mut answer = ANSWER;
                (answer[0], answer[7]) = (address, answer[7].wrapping_sub(address - 5));
                answer
            })
            .collect();
        for first in 0..4 {
            let mut bench = Bench::asked();
            for address in 6..=8 {
                bench.wait_until(bench.now + 500);
                bench.master.begin(node(address), &ANGLE, Instant::from_micros(bench.now)).unwrap();
                bench.released();
            }
            bench.outcomes.clear();
            for turn in 0..4 {
                bench.hear(bench.now + 100, &answers[(first + turn) % 4]);
            }
            bench.wait_until(bench.now + 2 * LATE);
            assert!(bench.only_outcome().result.is_err(), "{first}: {:?}", bench.outcomes);
            assert_eq!(bench.master.counters().late, 4);
            // What is asked in time is answered.
            bench.ask_node(8, bench.now);
            bench.hear(bench.now + 1_000, &answers[3]);
            assert_eq!(bench.only_outcome().result.as_ref().unwrap().address.get(), 8);
        }
    }
}
