//! Line and master together on a bit-exact segment, with simulated sensors: what the wire shows.

use std::sync::{Arc, Mutex};

use clino_bus::line::{self, EchoMode};
use clino_bus::{Duration, Fault, Instant, Isu, Serial, T7, Timing};
use clino_codec::t7::{Axis, Request, Response};
use clino_codec::{isu, t7};
use clino_segment::chance::Chance;
use clino_segment::log::{Fate, LineEvent, Talker};
use clino_segment::{Babble, Faults, Noise, SegmentSettings, Station};
use clino_sim::fault;
use clino_sim::latency::Latency;
use clino_sim::motion::Motion;
use clino_sim::t7::{Identity, Options};
use clino_testkit::rig::{Bench, sensor};

const DEGREE: i64 = 1_000_000;
const US: u64 = 1_000;
const MS: u64 = 1_000_000;
const ANGLE: Request = Request::GetAngle(Axis::Two);

fn wire(echo: bool) -> SegmentSettings {
    SegmentSettings { chance: Chance::new(1), echo, noise: Noise::default() }
}

fn timing() -> Timing {
    Timing::t7(Serial::T7_DEFAULT)
}

fn node(address: u8) -> t7::Address {
    t7::Address::new(address).unwrap()
}

type Shared = Arc<Mutex<clino_sim::t7::T7>>;

/// A T7 that turns by 36° a second, 0.036° a millisecond.
fn turning(address: u8, latency: u64) -> Shared {
    let options = Options {
        motion: [const { Motion::Ramp { start: 0, rate: 36 * DEGREE } }; 3],
        get_latency: Latency::fixed(latency),
        ..Options::default()
    };
    let stored = clino_sim::t7::StoredSettings { address, ..Default::default() };
    Arc::new(Mutex::new(clino_sim::t7::T7::new(Identity::default(), stored, options).unwrap()))
}

fn station(node: &Shared) -> Station {
    sensor("t7", Box::new(Arc::clone(node)))
}

fn bench(line: line::LineSettings, echo: bool, nodes: &[&Shared]) -> Bench<T7> {
    Bench::with_line(timing(), line, wire(echo), nodes.iter().map(|node| station(node)).collect())
}

/// Instants at which DE rose and fell, in nanoseconds.
fn driver_edges(bench: &Bench<T7>) -> Vec<(u64, bool)> {
    let log = bench.port.log();
    let log = log.lock().unwrap();
    let edge = |event: &LineEvent| match *event {
        LineEvent::De { at, high } => Some((at, high)),
        _ => None,
    };
    log.events.iter().filter_map(edge).collect()
}

fn contentions(bench: &Bench<T7>) -> usize {
    let log = bench.port.log();
    let log = log.lock().unwrap();
    log.events.iter().filter(|event| matches!(event, LineEvent::Contention { .. })).count()
}

/// First start bits of the gateway's requests, ends of their last stop bits, in nanoseconds.
fn requests(bench: &Bench<T7>) -> Vec<(u64, u64)> {
    let log = bench.port.log();
    let log = log.lock().unwrap();
    let mut requests: Vec<(u64, u64)> = Vec::new();
    for event in &log.events {
        let LineEvent::Char { who: Talker::Gateway, start, end, fate, .. } = *event else { continue };
        assert_eq!(fate, Fate::Clean);
        match requests.last_mut() {
            Some((_, last)) if start <= *last + US => *last = end,
            _ => requests.push((start, end)),
        }
    }
    requests
}

#[cfg(feature = "many-nodes")]
#[test]
fn a_dead_t7_costs_no_more_than_2600_us() {
    let mut bench = bench(timing().line(), false, &[]);
    for address in 1..=20 {
        let outcome = bench.ask(node(address), &ANGLE);
        assert!(matches!(outcome.result, Err(Fault::NoAnswer { .. })));
    }
    let requests = requests(&bench);
    assert_eq!(requests.len(), 20);
    let longest = requests.windows(2).map(|pair| pair[1].0 - pair[0].0).max().unwrap();
    println!("a dead T7 costs {longest} ns, first start bit to first start bit");
    assert!(longest <= 2_600 * US, "{longest}");
}

#[cfg(feature = "many-nodes")]
#[test]
fn a_t7_that_has_just_died_costs_six_milliseconds_more_once() {
    let (mortal, other) = (turning(5, 2 * MS), turning(6, 2 * MS));
    let mut bench = bench(timing().line(), false, &[&mortal, &other]);
    for address in [5, 6] {
        assert!(bench.ask(node(address), &ANGLE).result.is_ok());
    }
    mortal.lock().unwrap().faults.deaf = true;
    for _ in 0..20 {
        assert!(bench.ask(node(5), &ANGLE).result.is_err());
        assert!(bench.ask(node(6), &ANGLE).result.is_ok());
        let now = bench.port.now();
        bench.run_until(now + Duration::from_micros(25_000));
    }
    // Every second request is to the dead node; from it to the next one.
    let requests = requests(&bench);
    let costs: Vec<u64> = requests[2..].chunks(2).map(|pair| pair[1].0 - pair[0].0).collect();
    assert!(costs[0] <= 8_600 * US, "{costs:?}");
    assert!(costs[1..].iter().all(|&cost| cost <= 2_600 * US), "{costs:?}");
}

#[test]
fn an_answer_at_once_is_not_lost_whatever_the_delays() {
    for post_delay in [0, 50, 150, 400] {
        for (echo, mode) in [
            (false, EchoMode::Off),
            (false, EchoMode::Detect),
            (true, EchoMode::Expected),
            (true, EchoMode::Detect),
        ] {
            let post_delay = Duration::from_micros(post_delay);
            let line = line::LineSettings {
                post_delay,
                pre_delay: Duration::from_micros(20),
                echo: mode,
                ..timing().line()
            };
            // 170 µs after our last stop bit.
            let t7 = turning(5, 170 * US);
            let mut bench = bench(line, echo, &[&t7]);
            let results: Vec<_> = (0..5).map(|_| bench.ask(node(5), &ANGLE).result).collect();
            // A driver that is still on fights the first character: nothing can be heard then, except where the
            // receiver is always on, which hears the end of it and lets go.
            let fought = contentions(&bench) > 0;
            assert_eq!(fought, post_delay.as_micros() > 170, "{post_delay:?}");
            if !fought {
                assert!(results.iter().all(Result::is_ok), "{post_delay:?} {mode:?}: {results:?}");
                let counters = bench.master.counters();
                assert_eq!((counters.good, counters.discarded, counters.contention), (5, 0, 0));
                assert_eq!(counters.echo, if echo { 15 } else { 0 }, "{mode:?}");
            }
        }
    }
}

#[test]
fn the_driver_is_on_for_the_frame_and_its_delays() {
    for (pre, post) in [(0, 0), (30, 0), (0, 70), (30, 70)] {
        let (pre_delay, post_delay) = (Duration::from_micros(pre as u32), Duration::from_micros(post as u32));
        let line = line::LineSettings { pre_delay, post_delay, ..timing().line() };
        let t7 = turning(5, 2 * MS);
        let mut bench = bench(line, false, &[&t7]);
        assert!(bench.ask(node(5), &ANGLE).result.is_ok());
        let edges = driver_edges(&bench);
        let [(rise, true), (fall, false)] = edges[..] else { panic!("{edges:?}") };
        let (start, end) = requests(&bench)[0];
        // An interrupt a microsecond after transmission complete, and times in whole microseconds.
        assert!((pre * US..=(pre + 1) * US).contains(&(start - rise)), "{}", start - rise);
        assert!((post * US..=(post + 3) * US).contains(&(fall - end)), "{}", fall - end);
    }
}

#[test]
fn a_node_transmitting_during_our_frame_is_contention() {
    // A node that babbles without listening, once a millisecond.
    let babble = Babble { from: 10 * MS, until: 200 * MS, gap: MS };
    let faults = Faults { babble: vec![babble], ..Faults::default() };
    let t7 = turning(5, 2 * MS);
    let stranger = Station { faults, ..station(&turning(9, 2 * MS)) };
    let line = line::LineSettings { echo: EchoMode::Expected, ..timing().line() };
    let mut bench = Bench::<T7>::with_line(timing(), line, wire(true), vec![station(&t7), stranger]);
    let mut contended = 0;
    while bench.port.now() < Instant::from_micros(190_000) {
        if bench.ask(node(5), &ANGLE).result == Err(Fault::Contention) {
            contended += 1;
        }
    }
    assert!(contended > 0, "{:?}", bench.master.counters());
    assert!(bench.master.counters().contention >= contended);
    // A node that took a piece of all this for the beginning of a command is deaf for half a second.
    bench.run_until(Instant::from_micros(800_000));
    assert!(bench.ask(node(5), &ANGLE).result.is_ok());
}

/// The angle of the answer is one that the sensor had between our request and the end of the answer.
fn check_fresh(node: &Shared, answer: &t7::Answer, asked: Instant, at: Instant) {
    let Response::GetAngle { angle, .. } = answer.response else { panic!("{answer:?}") };
    let truth = |at: Instant| node.lock().unwrap().angle_at(2, at.as_micros() * US);
    assert!((truth(asked)..=truth(at)).contains(&angle.0), "{angle:?} between {asked:?} and {at:?}");
}

#[test]
fn late_answers_never_become_the_next_ones() {
    // 0 to 25 ms late, and a second node asked meanwhile.
    for late in (0..=25_000).step_by(613) {
        let (slow, good) = (turning(5, 2 * MS), turning(6, 300 * US));
        let mut bench = bench(timing().line(), false, &[&slow, &good]);
        let (mut answered, mut good_answered) = (0, 0);
        for round in 0..12 {
            if round % 3 == 1 {
                slow.lock().unwrap().faults.next = Some(fault::AnswerFault::Late(late * US));
            }
            for (address, node_of) in [(5, &slow), (6, &good)] {
                let asked = bench.port.now();
                let outcome = bench.ask(node(address), &ANGLE);
                let Ok(answer) = outcome.result else { continue };
                assert_eq!(answer.address.get(), address);
                check_fresh(node_of, &answer, asked, outcome.at);
                let count = if address == 5 { &mut answered } else { &mut good_answered };
                *count += 1;
            }
        }
        println!("{late} us late: {answered} and {good_answered} of 12");
        // A node that has answered is left the line for 6 ms more: within that nothing collides, and the line is left to
        // it for longer from then on. Answers up to 2 ms late are learned to be waited for.
        match late {
            0..=1_900 => {
                assert!(answered >= 11 && good_answered == 12, "{late}: {answered}, {good_answered}")
            }
            1_901..=5_900 => {
                assert!(answered == 8 && good_answered == 12, "{late}: {answered}, {good_answered}")
            }
            _ => {}
        }
    }
}

#[test]
fn a_node_that_becomes_a_millisecond_too_slow_is_lost_only_once() {
    let (slow, good) = (turning(5, 2 * MS), turning(6, 300 * US));
    let mut bench = bench(timing().line(), false, &[&slow, &good]);
    for address in [5, 6] {
        assert!(bench.ask(node(address), &ANGLE).result.is_ok());
    }
    slow.lock().unwrap().faults.every = Some((1, fault::AnswerFault::Late(MS)));
    let mut failed = 0;
    for _ in 0..100 {
        for address in [5, 6] {
            failed += u32::from(bench.ask(node(address), &ANGLE).result.is_err());
        }
    }
    assert_eq!((failed, bench.master.counters().late), (1, 1));
}

#[test]
fn the_bit_rate_changes_live() {
    let t7 = turning(5, 2 * MS);
    let mut bench = bench(timing().line(), false, &[&t7]);
    assert!(bench.ask(node(5), &ANGLE).result.is_ok());
    let answer = bench.ask(node(5), &Request::SetBaudRate(t7::BaudRate::B9600)).result.unwrap();
    assert_eq!(answer.response.status().map(|status| status.get()), Some(0));
    // The device follows 10 ms after its answer.
    let now = bench.port.now();
    bench.run_until(now + Duration::from_micros(11_000));
    let slow = Timing::t7(Serial { baud: 9_600 });
    bench.master.set_timing(slow);
    bench.port.set_serial(slow.serial, slow.guard);
    assert!(bench.ask(node(5), &ANGLE).result.is_ok());
    // No node answers at the old rate any more, and one does at the new rate.
    for (timing, there) in [(timing(), false), (slow, true)] {
        bench.settle();
        bench.master.set_timing(timing);
        bench.port.set_serial(timing.serial, timing.guard);
        // A device that heard half a command at the wrong rate forgets it within 500 ms.
        let now = bench.port.now();
        bench.run_until(now + Duration::from_micros(600_000));
        assert_eq!(bench.ask(node(5), &ANGLE).result.is_ok(), there);
    }
}

#[test]
fn a_slow_eeprom_write_is_waited_for() {
    use clino_sim::isu::{ChecksumScope, Content, Eeprom, Isu as Module, Options};
    let eeprom = Eeprom::factory(Content { address: 3, ..Content::default() }, ChecksumScope::default(), 1);
    let words = isu::Words::new(&[0x1234; 8]).unwrap();
    // Eight words at 45 ms, and 1 ms of lead.
    let options = Options { word_write_time: 45 * MS, ..Options::default() };
    let module = sensor("isu", Box::new(Module::new(eeprom, options)));
    let mut bench = Bench::<Isu>::new(Timing::isu(), wire(false), vec![module]);
    let request = isu::Request::WriteEeprom { start: 0x50, words };
    let outcome = bench.ask(isu::Address::new(3).unwrap(), &request);
    assert!(outcome.result.is_ok(), "{:?}", outcome.result);
    let counters = bench.master.counters();
    assert_eq!((counters.writes, counters.good), (1, 1));
    assert!(counters.response_last > Duration::from_micros(361_000));
}

#[test]
fn all_nodes_on_the_bus_are_collected() {
    // At 0.4, 1.2 and 1.9 ms, so that the answers of 0.7 ms do not meet.
    let nodes = [turning(1, 200 * US), turning(50, 1_000 * US), turning(100, 1_900 * US)];
    let mut bench = bench(timing().line(), false, &[&nodes[0], &nodes[1], &nodes[2]]);
    let now = bench.port.now();
    let frame = bench
        .master
        .begin_collecting(t7::Address::ALL, &ANGLE, Duration::from_micros(5_000), now)
        .expect("a request");
    bench.port.submit(frame.as_ref(), now + Duration::from_micros(5_900)).unwrap();
    let mut senders = Vec::new();
    let sum = loop {
        match bench.run_until(Instant::from_micros(100_000)).expect("it ends").result {
            Ok(answer) => senders.push(answer.address.get()),
            Err(fault) => break fault,
        }
    };
    assert_eq!(sum, Fault::Over { answers: 3, garbled: 0 });
    assert_eq!(senders, [1, 50, 100]);
}
