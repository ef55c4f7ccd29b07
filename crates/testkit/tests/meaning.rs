//! A change of what a sensor's number means, at any time and however it goes: from its instant on, nothing is published as
//! *ok* that the sensor is not at.
//!
//! The gateway core reads simulated sensors bit by bit, and the truth is theirs: what their own memory makes of the true
//! angle now. Host only: the virtual board has no access to the sensors' memory while the image runs, and thirty virtual
//! seconds of it take minutes. What it does show of this is in `host-tests/tests/board/meaning.rs`.

mod support;

use clino_codec::angle::{Angle, Range};
use clino_codec::isu::eeprom::Change;
use clino_codec::t7::{Axis, Direction, Millidegrees};
use clino_commissioning::isu::Module;
use clino_commissioning::t7::{Device, DeviceSetting};
use clino_gateway::config::Filter;
use clino_gateway::order::Order;
use clino_gateway::task::{isu, t7};
use clino_gateway::{Bus, SlotConfig, Source, Status};
use clino_sim::fault::AnswerFault as Fault;
use support::{Dice, House, ISU, Moves, PWM, SECOND, SLOTS, any_config, isu_address, t7_source, table};

/// Nothing moves.
const AT_REST: Moves =
    Moves { t7: [(10_000_000, 0), (0, 0), (12_345_000, 0), (-100_000_000, 0)], isu: (100_000_000, 0) };

fn device(number: u8) -> Device {
    let Source::T7 { address, .. } = t7_source(number, Axis::Two) else { panic!("a T7") };
    Device::at(address).unwrap()
}

fn module() -> Module {
    Module::at(isu_address()).unwrap()
}

fn slot(slot: usize, config: SlotConfig) -> Order {
    Order::Slot { slot: slot as u8, config }
}

/// How far off a published angle may be, in 0.001°: what the sensor resolves, and what it turns while a filter of eight
/// and an ISU's refresh look back.
fn tolerance(house: &House, slot: usize, fastest: i64) -> i64 {
    let config = house.gateway.config(slot).unwrap();
    let resolution = match config.source {
        Source::T7 { .. } => 2,
        _ => 8,
    };
    // Eight readings of an ISU, a refresh each, and the last refresh.
    resolution + if fastest == 0 { 0 } else { fastest / 1_000 * 6 }
}

/// Checks every slot as it is published now.
#[track_caller]
fn check(house: &mut House, fastest: i64, what: &str) {
    for slot in 0..SLOTS {
        if let Some(error) = house.error(slot) {
            let most = tolerance(house, slot, fastest);
            let said = house.reading(slot);
            assert!(
                error <= most,
                "slot {slot} says {:?} as ok, {error} m° off, at {} us: {what}",
                said.angle(clino_bus::Instant::from_micros(house.now)),
                house.now
            );
            let turns = said.turns();
            assert!(fastest > 0 || turns == 0, "slot {slot} has turned {turns} times at rest: {what}");
        }
    }
}

/// Runs with every published value checked.
fn run(house: &mut House, until: u64, fastest: i64, what: &str) {
    house.run(until, |house| check(house, fastest, what));
}

fn all_ok(house: &mut House, what: &str) {
    for slot in 0..SLOTS {
        if house.truth(slot).is_none() {
            continue;
        }
        assert_eq!(house.status(slot), Status::Ok, "slot {slot} at {} us: {what}", house.now);
    }
}

/// Runs one order from a house in which all is read, to a house in which all is read again.
fn carried_out(house: &mut House, order: Order, what: &str) {
    let end = house.now + 2 * SECOND;
    run(house, end, 0, what);
    all_ok(house, "before");
    house.order(order).unwrap_or_else(|refusal| panic!("{what}: {refusal:?}"));
    let end = house.now + 14 * SECOND;
    run(house, end, 0, what);
    all_ok(house, what);
}

/// The example: an ISU at 100°, a mean of eight, `isu zero`. What was published of it passed through every angle.
#[test]
fn a_mean_of_eight_does_not_lead_from_the_old_zero_to_the_new() {
    let mut table = table();
    (table[ISU].filter, table[ISU].samples) = (Filter::Mean, 8);
    (table[PWM].filter, table[PWM].samples) = (Filter::Mean, 8);
    let mut house = House::new(&table, &AT_REST);
    carried_out(&mut house, Order::Isu(isu::Task::ResetNull(module())), "isu zero");
    assert!(house.error(ISU).is_some_and(|error| error <= 6) && house.truth(ISU).is_some());
    assert!(house.isu().null() > 0, "the module has taken it");
}

#[test]
fn a_reversed_t7_does_not_pass_through_half_a_turn() {
    for filter in [(Filter::Mean, 8), (Filter::Median, 8), (Filter::Mean, 3)] {
        let mut table = table();
        table.iter_mut().for_each(|slot| (slot.filter, slot.samples) = filter);
        let mut moves = AT_REST;
        moves.t7 = [(170_000_000, 0), (0, 0), (-175_000_000, 0), (90_000_000, 0)];
        let mut house = House::new(&table, &moves);
        for axis in [Axis::Zero, Axis::Two] {
            let setting = DeviceSetting::Direction { axis, direction: Direction::Reversed };
            carried_out(&mut house, Order::T7(t7::Task::Set(device(1), setting)), "direction");
        }
        // Said to the slot, not to the sensor.
        let config = SlotConfig { direction: Direction::Reversed, ..*house.gateway.config(2).unwrap() };
        carried_out(&mut house, slot(2, config), "direction of the slot");
    }
}

#[test]
fn a_sensor_zeroed_at_rest_has_not_turned() {
    let mut moves = AT_REST;
    moves.t7 = [(-179_000_000, 0), (0, 0), (179_000_000, 0), (-100_000_000, 0)];
    moves.isu = (355_000_000, 0);
    let mut house = House::new(&table(), &moves);
    carried_out(&mut house, Order::T7(t7::Task::Zero(device(1), Axis::Zero)), "zero of axis 0");
    carried_out(&mut house, Order::T7(t7::Task::Zero(device(1), Axis::Two)), "zero of axis 2");
    carried_out(&mut house, Order::Isu(isu::Task::Program(module(), Change::NullPosition(0x8000))), "null");
    carried_out(&mut house, Order::Isu(isu::Task::ResetNull(module())), "isu zero");
    for slot in 0..SLOTS {
        assert_eq!(house.reading(slot).turns(), 0, "slot {slot}");
    }
}

/// Without confirmation the first number after the write would be published at once.
#[test]
fn an_unconfirmed_slot_is_held_as_well() {
    let mut table = table();
    table.iter_mut().for_each(|slot| slot.confirm = false);
    let mut house = House::new(&table, &AT_REST);
    let offset = DeviceSetting::Offset { axis: Axis::Two, offset: Millidegrees(90_000) };
    carried_out(&mut house, Order::T7(t7::Task::Set(device(1), offset)), "offset");
    carried_out(&mut house, Order::Isu(isu::Task::ResetNull(module())), "isu zero");
    carried_out(&mut house, Order::Isu(isu::Task::Reset(module())), "isu reset");
}

/// The slot is set anew in the middle of it: it begins with nothing, and must not believe the module's old angle.
#[test]
fn a_slot_set_during_the_task_is_held_too() {
    for after in (0..700).step_by(37) {
        let mut table = table();
        table[ISU].confirm = false;
        let mut house = House::new(&table, &AT_REST);
        run(&mut house, 2 * SECOND, 0, "before");
        house.order(Order::Isu(isu::Task::ResetNull(module()))).unwrap();
        let end = house.now + after * 1_000;
        run(&mut house, end, 0, "the task has begun");
        let config = *house.gateway.config(ISU).unwrap();
        house.order(slot(ISU, SlotConfig { filter: Filter::Mean, samples: 4, ..config })).unwrap();
        let end = house.now + 14 * SECOND;
        run(&mut house, end, 0, "set anew");
        all_ok(&mut house, "set anew");
    }
}

/// The request is lost, or its answer: in either case what is published is what the sensor says then.
#[test]
fn a_write_that_may_have_happened_counts_as_one() {
    let writes = |house: &House| (house.t7(0).writes(), house.isu().writes());
    for lost_answer in [true, false] {
        let mut house = House::new(&table(), &AT_REST);
        run(&mut house, 2 * SECOND, 0, "before");
        let before = writes(&house);
        let offset = DeviceSetting::Offset { axis: Axis::Two, offset: Millidegrees(45_000) };
        house.order(Order::T7(t7::Task::Set(device(1), offset))).unwrap();
        house.order(Order::Isu(isu::Task::ResetNull(module()))).unwrap();
        for _ in 0..40 {
            // Every other answer, whatever to; or nothing heard for a while.
            let fault = lost_answer.then_some((2, Fault::Silent));
            house.t7(0).faults.every = fault.clone();
            house.isu().faults.every = fault;
            house.isu().faults.deaf = !lost_answer;
            let end = house.now + 25_000;
            run(&mut house, end, 0, "answers are lost");
            house.isu().faults.deaf = false;
            let end = house.now + 25_000;
            run(&mut house, end, 0, "answers are lost");
        }
        house.t7(0).faults.every = None;
        house.isu().faults.every = None;
        let end = house.now + 8 * SECOND;
        run(&mut house, end, 0, "all is well again");
        all_ok(&mut house, "all is well again");
        assert_eq!(house.news.len(), 2, "{:?}", house.news);
        assert!(writes(&house).0 > before.0, "the T7 was written to");
    }
}

#[test]
fn another_bit_rate_begins_anew() {
    let mut house = House::new(&table(), &AT_REST);
    run(&mut house, 2 * SECOND, 0, "before");
    house.order(Order::T7(t7::Task::Baud(device(1), clino_codec::t7::BaudRate::B57600))).unwrap();
    let end = house.now + 6 * SECOND;
    run(&mut house, end, 0, "baud");
    assert_eq!((house.status(0), house.status(1)), (Status::Ok, Status::Ok));
    assert_ne!(house.status(2), Status::Ok, "the other one is not at that rate");
    assert_eq!(house.gateway.timing(Bus::T7).serial.baud, 57_600);
}

/// A T7 that is asked for everything says its serial number: another one at its address is another sensor.
#[test]
fn another_device_at_the_same_address_begins_anew() {
    let mut table = table();
    (table[6].filter, table[6].samples) = (Filter::Mean, 8);
    (table[1].filter, table[1].samples) = (Filter::Mean, 8);
    let mut house = House::new(&table, &AT_REST);
    run(&mut house, 2 * SECOND, 0, "before");
    all_ok(&mut house, "before");
    let sequence = house.reading(1).sequence;
    let other = House::new(&table, &Moves { t7: [(-60_000_000, 0); 4], ..AT_REST });
    let mut replacement = other.t7(0).clone();
    replacement.replace_serial(4_711);
    *house.t7s[0].lock().unwrap() = replacement;
    // Nothing on the bus shows it before slot 6 is asked; from then on no slot of the node mixes both.
    let end = house.now + 60_000;
    house.run(end, |_| {});
    let end = house.now + 2 * SECOND;
    run(&mut house, end, 0, "replaced");
    all_ok(&mut house, "replaced");
    assert_ne!(house.reading(1).sequence, sequence);
}

/// Any settings, any motion, any changes, at any time, with and without lost answers.
#[test]
fn whatever_changes_no_published_value_is_one_that_the_sensor_was_not_at() {
    let seeds = std::env::var("CLINO_SEEDS").map_or(12, |text| text.parse().expect("a number"));
    (0..seeds).for_each(any_changes);
}

fn any_changes(seed: u64) {
    let mut dice = Dice::new(seed + 1);
    let dice = &mut dice;
    let fastest = dice.one_of(&[0, 0, 500_000]);
    let angle = |dice: &mut Dice| dice.below(360_000) as i64 * 1_000 - 180_000_000;
    let any_motion = |dice: &mut Dice| {
        (angle(dice), if fastest == 0 { 0 } else { dice.one_of(&[-fastest, 0, fastest / 2, fastest]) })
    };
    let moves = Moves { t7: [(); 4].map(|()| any_motion(dice)), isu: any_motion(dice) };
    let table = table().map(|config| any_config(config, dice));
    let mut house = House::new(&table, &moves);
    run(&mut house, 3 * SECOND, fastest, "before");
    for _ in 0..5 {
        let (order, what) = any_change(&house, dice);
        let what = format!("seed {seed}, {what}");
        if dice.below(3) == 0 {
            let fault = Some((1 + dice.below(3), Fault::Silent));
            house.t7(0).faults.every = fault.clone();
            house.t7(1).faults.every = fault.clone();
            house.isu().faults.every = fault;
        }
        // A task may be under way; then it is another one's turn.
        _ = house.order(order);
        let end = house.now + dice.below(2 * SECOND);
        run(&mut house, end, fastest, &what);
        house.t7(0).faults.every = None;
        house.t7(1).faults.every = None;
        house.isu().faults.every = None;
        let end = house.now + dice.below(4 * SECOND);
        run(&mut house, end, fastest, &what);
    }
    let end = house.now + 16 * SECOND;
    run(&mut house, end, fastest, "the end");
    // A module whose writing was torn is not measuring; its address may be gone.
    for slot in [0, 1, 6] {
        assert_eq!(house.status(slot), Status::Ok, "slot {slot}, seed {seed}: {:?}", house.news);
    }
}

fn any_change(house: &House, dice: &mut Dice) -> (Order, String) {
    let axis = support::t7_axis(dice.below(2));
    let set = |setting| Order::T7(t7::Task::Set(device(1), setting));
    let order = match dice.below(10) {
        0 => Order::T7(t7::Task::Zero(device(1), axis)),
        1 => {
            let most = if house.t7(0).settings().range as u8 == 0 { 180_000 } else { 360_000 };
            set(DeviceSetting::Offset { axis, offset: Millidegrees(dice.below(most) as i32) })
        }
        2 => set(DeviceSetting::Direction {
            axis,
            direction: dice.one_of(&[Direction::Normal, Direction::Reversed]),
        }),
        3 => set(DeviceSetting::Range(dice.one_of(&[Range::Bidirectional, Range::Unidirectional]))),
        4 => {
            let (from, to) = if house.t7(1).settings().address == 2 { (2, 3) } else { (3, 2) };
            let address = |number| clino_codec::t7::Address::new(number).unwrap();
            Order::T7(t7::Task::Address { from: address(from), to: address(to) })
        }
        5 | 6 => Order::Isu(isu::Task::ResetNull(module())),
        7 => Order::Isu(isu::Task::Program(module(), Change::NullPosition(dice.below(65_536) as u16))),
        8 => Order::Isu(isu::Task::Reset(module())),
        _ => {
            let index = dice.below(SLOTS as u64) as usize;
            let config = any_config(*house.gateway.config(index).unwrap(), dice);
            slot(
                index,
                SlotConfig { soft_zero: Angle::from_mdeg(dice.below(360_000) as i32).unwrap(), ..config },
            )
        }
    };
    (order, format!("{order:?}"))
}
