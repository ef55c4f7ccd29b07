//! One order after another, at every instant of what goes on meanwhile.

use clino_bus::line::EchoMode;
use clino_bus::{Duration, Serial, Timing};
use clino_codec::angle::Angle;
use clino_codec::t7::{Axis, BaudRate};
use clino_commissioning::t7::{Cause, DeviceSetting, Failure};
use clino_commissioning::{Report, SettingChange};
use clino_gateway::order::{Order, Refusal};
use clino_gateway::task::t7::Task;
use clino_gateway::task::{TaskEvent, t7 as told};
use clino_gateway::{Bus, BusChange, Requester, SlotConfig, Source};
use clino_sim::motion::Motion;

use super::site::{Site, address, device, slot, t7};

/// T7 guide section 1: a command has to arrive within 500 ms.
const DEAF: Duration = Duration::from_micros(500_000);
const STILL: Motion = Motion::Constant(30_000_000);

fn baud(baud: u32) -> BusChange {
    BusChange { baud: Some(baud), ..BusChange::NONE }
}

fn guard(us: u64) -> BusChange {
    BusChange { guard: Some(Duration::from_micros(us as u32)), ..BusChange::NONE }
}

fn is_baud(news: &TaskEvent, rate: BaudRate) -> bool {
    matches!(news, TaskEvent::T7(told::TaskEvent::Baud(Report { change: SettingChange::Changed { to, .. }, .. })) if *to == rate)
}

fn settings(site: &Site) -> (u32, u64) {
    let settings = site.gateway.bus_settings(Bus::T7);
    (settings.timing.serial.baud, u64::from(settings.timing.guard.as_micros()))
}

/// All fields that are not the bit rate, at every millisecond of a change of the bit rate: both are in force in the
/// end.
#[test]
fn a_change_during_a_change_of_bit_rate_undoes_neither() {
    let changes = [
        guard(300),
        BusChange { pre_delay: Some(Duration::from_micros(50)), ..BusChange::NONE },
        BusChange { post_delay: Some(Duration::from_micros(20)), ..BusChange::NONE },
        BusChange { echo: Some(EchoMode::Detect), ..BusChange::NONE },
    ];
    for change in changes {
        for after in 0..80 {
            let mut site = Site::new(vec![t7(1, 0, STILL)]);
            site.run(Duration::from_micros(200_000));
            site.order(Order::T7(Task::Baud(device(1), BaudRate::B57600))).unwrap();
            site.run(Duration::from_micros(after * 1_000));
            site.change(change).unwrap();
            site.finish();
            site.run(Duration::from_micros(700_000));
            assert!(is_baud(&site.news[0], BaudRate::B57600), "{:?}", site.news);
            let usual = Timing::t7(Serial { baud: 57_600 });
            let (_, timing, line) = site.runs.last().unwrap();
            assert_eq!(timing.serial.baud, 57_600, "{change:?} after {after} ms");
            assert_eq!(timing.guard, change.guard.unwrap_or(usual.guard));
            assert_eq!(line.guard, timing.guard);
            assert_eq!(line.pre_delay, change.pre_delay.unwrap_or(Duration::ZERO));
            assert_eq!(line.post_delay, change.post_delay.unwrap_or(Duration::ZERO));
            assert_eq!(line.echo, change.echo.unwrap_or(EchoMode::Off));
            let shown = site.gateway.bus_settings(Bus::T7);
            assert_eq!((&shown.timing, &shown.line), (timing, line), "the line runs as the settings say");
            assert!(site.gateway.is_in_force(Bus::T7));
        }
    }
}

/// A bit rate is the task's while there is one: refused at every instant, and the task is not disturbed. A rate that is
/// no change is refused while the rate changes, and only then.
#[test]
fn a_bit_rate_is_refused_while_a_task_needs_it() {
    let tasks = [
        Task::Identify(device(1)),
        Task::Sweep(clino_commissioning::t7::Rates::NONE.and(BaudRate::B115200)),
        Task::Set(device(1), DeviceSetting::Damping(70)),
        Task::Zero(device(1), Axis::Two),
        Task::Address { from: address(1), to: address(9) },
        Task::Baud(device(1), BaudRate::B57600),
    ];
    for task in tasks {
        for after in (0..60).step_by(3) {
            let mut site = Site::new(vec![t7(1, 0, STILL)]);
            site.run(Duration::from_micros(200_000));
            site.order(Order::T7(task)).unwrap();
            site.run(Duration::from_micros(after * 1_000));
            if site.gateway.progress(Bus::T7).is_none() {
                break;
            }
            assert_eq!(site.change(baud(9_600)), Err(Refusal::Busy), "{task:?} after {after} ms");
            let same = site.change(BusChange { baud: Some(115_200), ..guard(300) });
            let changes = matches!(task, Task::Baud(..));
            assert_eq!(same, if changes { Err(Refusal::Busy) } else { Ok(()) }, "{task:?} after {after} ms");
            site.finish();
            let failed =
                site.news.iter().any(|news| matches!(news, TaskEvent::T7(told::TaskEvent::Failed(_))));
            assert!(!failed, "{:?}", site.news);
            site.run(Duration::from_micros(1_000));
            let expected = if changes { (57_600, 174) } else { (115_200, 300) };
            assert_eq!(settings(&site), expected, "{task:?} after {after} ms");
        }
    }
}

/// Twenty instants; each time the sensors are at the new rate already and have received the old one as noise.
#[test]
fn a_task_after_a_change_of_bit_rate_begins_at_the_new_rate_after_the_silence() {
    for phase in 0..20 {
        let mut site = Site::new((1..=3).map(|node| t7(node, 1, STILL)).collect());
        site.run(Duration::from_micros(1_000_000 + phase * 1_300));
        let asked = site.sent.len();
        assert!(asked > 20);
        site.change(baud(57_600)).unwrap();
        let ordered = site.now();
        site.order(Order::T7(Task::Identify(device(2)))).unwrap();
        site.finish();
        assert!(
            matches!(site.news[..], [TaskEvent::T7(told::TaskEvent::Identity(_))]),
            "phase {phase}: {:?}",
            site.news
        );
        // What was out already ends within a few milliseconds; then there is silence.
        let first = &site.sent[asked];
        assert_eq!(first.baud, 57_600);
        let silence = first.at.since(ordered);
        assert!(
            (DEAF..DEAF + Duration::from_micros(60_000)).contains(&silence),
            "phase {phase}: {silence:?}"
        );
        site.run(Duration::from_micros(200_000));
        let ok = site.sent[asked..].iter().filter(|sent| sent.bytes.len() == 3);
        assert!(ok.count() > 5, "the slots are read again");
        assert!(site.sent[asked..].iter().all(|sent| sent.baud == 57_600));
    }
}

#[test]
fn polls_keep_silent_after_a_change_of_bit_rate_and_each_begins_the_silence_anew() {
    let mut site = Site::new((1..=3).map(|node| t7(node, 2, STILL)).collect());
    site.run(Duration::from_micros(1_000_000));
    site.change(baud(57_600)).unwrap();
    site.run(Duration::from_micros(300_000));
    let asked = site.sent.len();
    site.change(baud(38_400)).unwrap();
    let ordered = site.now();
    site.run(Duration::from_micros(1_000_000));
    assert!(site.sent[asked].at.since(ordered) >= DEAF, "{:?}", site.sent[asked]);
    assert_eq!(site.sent[asked].baud, 38_400);
    for slot in 0..3 {
        assert!(site.gateway.detail(slot).unwrap().counters.no_answer > 0, "at the first rate");
        assert!(site.gateway.detail(slot).unwrap().counters.first_try > 3, "slot {slot} is read");
    }
}

/// The sensor that has moved is followed at once, the others need a silence first.
#[test]
fn after_a_task_has_changed_the_bit_rate_the_next_one_waits_for_the_nodes() {
    // Node 2 is at the new rate before the bus is, and has heard 115200 as noise.
    let mut site = Site::new(vec![t7(1, 0, STILL), t7(2, 1, STILL)]);
    site.run(Duration::from_micros(500_000));
    site.order(Order::T7(Task::Baud(device(1), BaudRate::B57600))).unwrap();
    site.finish();
    let asked = site.sent.len();
    let before = site.sent[asked - 1].at;
    site.order(Order::T7(Task::Identify(device(2)))).unwrap();
    site.finish();
    assert!(matches!(site.news[1], TaskEvent::T7(told::TaskEvent::Identity(_))), "{:?}", site.news);
    assert!(site.sent[asked].at.since(before) >= DEAF, "{:?}", site.sent[asked]);
    assert!(site.sent[asked..].iter().all(|sent| sent.baud == 57_600));
}

#[test]
fn a_task_that_is_cancelled_before_it_has_begun_sends_nothing() {
    for task in [
        Task::Identify(device(1)),
        Task::Sweep(clino_commissioning::t7::Rates::ALL),
        Task::Set(device(1), DeviceSetting::Damping(70)),
        Task::Zero(device(1), Axis::Two),
        Task::Address { from: address(1), to: address(9) },
        Task::Baud(device(1), BaudRate::B57600),
    ] {
        let mut site = Site::new(vec![t7(1, 0, STILL)]);
        site.run(Duration::from_micros(200_000));
        site.change(baud(57_600)).unwrap();
        site.run(Duration::from_micros(50_000));
        let sent = site.sent.len();
        site.order(Order::T7(task)).unwrap();
        site.run(Duration::from_micros(50_000));
        assert!(site.gateway.progress(Bus::T7).is_some(), "it waits");
        site.order(Order::Cancel(Bus::T7)).unwrap();
        site.run(Duration::from_micros(10_000));
        assert_eq!(site.sent.len(), sent);
        let ended = match site.news[..] {
            [TaskEvent::T7(told::TaskEvent::Failed(Failure { cause: Cause::Cancelled, writes: 0 }))] => true,
            [TaskEvent::T7(told::TaskEvent::Swept(swept))] => !swept.complete && swept.asked == 0,
            _ => false,
        };
        assert!(ended, "{task:?}: {:?}", site.news);
        assert_eq!(site.gateway.progress(Bus::T7), None);
    }
}

/// Every sensor that keeps a guard which was set by hand keeps it at every bit rate, by whatever way it comes.
#[test]
fn a_guard_set_by_hand_stays_and_the_usual_one_follows() {
    for (by_hand, expected) in [(None, 174), (Some(300), 300)] {
        for by_task in [false, true] {
            let mut site = Site::new(vec![t7(1, 0, STILL)]);
            by_hand.into_iter().for_each(|us| site.change(guard(us)).unwrap());
            site.run(Duration::from_micros(200_000));
            if by_task {
                site.order(Order::T7(Task::Baud(device(1), BaudRate::B57600))).unwrap();
                site.finish();
            } else {
                site.change(baud(57_600)).unwrap();
                site.run(Duration::from_micros(100_000));
            }
            assert_eq!(settings(&site), (57_600, expected), "by task: {by_task}");
            let (_, timing, line) = site.runs.last().unwrap();
            assert_eq!(
                (timing.guard.as_micros(), line.guard.as_micros()),
                (expected as u32, expected as u32)
            );
        }
    }
    // Together with the rate it is what was said, also if that is what it was.
    let mut site = Site::new(vec![t7(1, 0, STILL)]);
    site.change(BusChange { baud: Some(57_600), ..guard(87) }).unwrap();
    assert_eq!(settings(&site), (57_600, 87));
}

/// A task that has failed leaves the bus as it was, and what was changed meanwhile.
#[test]
fn a_change_of_bit_rate_that_fails_leaves_what_was_changed_meanwhile() {
    for after in (0..2_500).step_by(100) {
        let mut site = Site::new(vec![t7(1, 0, STILL)]);
        site.run(Duration::from_micros(200_000));
        site.sensors[0].lock().unwrap().flash = clino_sim::t7::Flash::Fails;
        site.order(Order::T7(Task::Baud(device(1), BaudRate::B57600))).unwrap();
        site.run(Duration::from_micros(after * 100));
        site.change(guard(300)).unwrap();
        site.finish();
        site.run(Duration::from_micros(700_000));
        assert!(matches!(site.news[..], [TaskEvent::T7(told::TaskEvent::Failed(_))]), "{:?}", site.news);
        assert_eq!(settings(&site), (115_200, 300));
        let (_, timing, _) = site.runs.last().unwrap();
        assert_eq!((timing.serial.baud, timing.guard.as_micros()), (115_200, 300));
    }
}

/// What is saved in the end is known to be unsaved from the instant of the change on, fetched or not.
#[test]
fn the_revision_counts_what_a_task_has_changed_when_it_has() {
    for task in [
        Task::Baud(device(1), BaudRate::B57600),
        Task::Address { from: address(1), to: address(9) },
        Task::Set(device(1), DeviceSetting::Damping(70)),
    ] {
        let mut site = Site::new(vec![t7(1, 0, STILL)]);
        site.prompt = false;
        site.run(Duration::from_micros(200_000));
        let before = site.gateway.fingerprint();
        site.order(Order::T7(task)).unwrap();
        site.run(Duration::from_micros(5_000));
        assert_eq!(site.gateway.fingerprint(), before, "not yet");
        site.run(Duration::from_micros(2_000_000));
        assert!(site.gateway.has_task_event(Requester::Console));
        let changes = !matches!(task, Task::Set(..));
        assert_eq!(site.gateway.fingerprint() != before, changes, "{task:?}");
        let after = site.gateway.fingerprint();
        site.fetch();
        assert_eq!(site.gateway.fingerprint(), after);
    }
}

/// A slot refuses settings that a task will overwrite, and accepts all others.
#[test]
fn slots_change_during_a_change_of_address_but_for_the_two_addresses() {
    for after in (0..40).step_by(2) {
        let mut site = Site::new(vec![t7(1, 0, STILL), t7(2, 0, STILL)]);
        site.run(Duration::from_micros(200_000));
        site.order(Order::T7(Task::Address { from: address(1), to: address(9) })).unwrap();
        site.run(Duration::from_micros(after * 1_000));
        if site.gateway.progress(Bus::T7).is_none() {
            break;
        }
        let to = |config| Order::Slot { slot: 5, config };
        assert_eq!(site.order(to(slot(1))), Err(Refusal::Busy));
        assert_eq!(site.order(to(slot(9))), Err(Refusal::Busy));
        assert_eq!(site.order(to(slot(2))), Ok(()));
        let mine = SlotConfig { retries: 7, ..*site.gateway.config(0).unwrap() };
        assert_eq!(site.order(Order::Slot { slot: 0, config: mine }), Ok(()), "it keeps its address");
        assert_eq!(site.order(Order::Slot { slot: 1, config: SlotConfig::OFF }), Ok(()));
        site.finish();
        let source = |slot: usize| site.gateway.config(slot).unwrap().source;
        assert_eq!(source(0), Source::T7 { address: address(9), axis: Axis::Two });
        assert_eq!(site.gateway.config(0).unwrap().retries, 7);
        assert_eq!(source(1), Source::Off);
        assert_eq!(source(5), Source::T7 { address: address(2), axis: Axis::Two });
    }
}

/// The slot reads zero: what it has subtracted until then goes, of this axis and of no other.
#[test]
fn a_sensor_that_was_zeroed_reads_zero_in_its_slots() {
    let mut site = Site::new(vec![t7(1, 0, STILL), t7(2, 0, STILL)]);
    let zeroed = |number, axis| {
        let source = Source::T7 { address: address(number), axis };
        let soft_zero = Angle::from_mdeg(5_000).unwrap();
        SlotConfig { source, soft_zero, ..slot(number) }
    };
    for (number, config) in
        [zeroed(1, Axis::Two), zeroed(2, Axis::Two), zeroed(1, Axis::One)].into_iter().enumerate()
    {
        site.order(Order::Slot { slot: number as u8, config }).unwrap();
    }
    site.run(Duration::from_micros(500_000));
    site.order(Order::T7(Task::Zero(device(1), Axis::Two))).unwrap();
    // Meanwhile no other order sets it, except to the value that it will have.
    let mine = *site.gateway.config(0).unwrap();
    let other = SlotConfig { soft_zero: Angle::from_mdeg(1_000).unwrap(), ..mine };
    assert_eq!(site.order(Order::Slot { slot: 0, config: other }), Err(Refusal::Busy));
    assert_eq!(site.order(Order::Slot { slot: 0, config: SlotConfig { retries: 7, ..mine } }), Ok(()));
    site.finish();
    assert!(matches!(site.news[..], [TaskEvent::T7(told::TaskEvent::Zeroed(_))]), "{:?}", site.news);
    let zeros = [0, 1, 2].map(|slot| site.gateway.config(slot).unwrap().soft_zero.mdeg());
    assert_eq!(zeros, [0, 5_000, 5_000]);
    assert_eq!(site.gateway.config(0).unwrap().retries, 7);
    // Again: it is zero already, nothing is written, and the soft zero goes all the same.
    site.order(Order::Slot { slot: 0, config: mine }).unwrap();
    site.order(Order::T7(Task::Zero(device(1), Axis::Two))).unwrap();
    site.finish();
    assert_eq!(site.gateway.config(0).unwrap().soft_zero, Angle::ZERO);
    assert_eq!(site.sensors[0].lock().unwrap().writes(), 1);
}
