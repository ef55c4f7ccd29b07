//! Every kind of crash, planted into the running image: how long it lasts, and what the console, the Modbus port and the log
//! say of it afterwards.

use clino_board::incident::ResetCause;
use clino_host_tests::{Ran, modbus, run};

use crate::{MS, SECOND, planted, resets, said, typed};

/// FC 04 at 0x0980: all registers of the start.
const START_BLOCK: [u8; 5] = [4, 0x09, 0x80, 0, 28];
/// When the fault is planted.
const AT_MS: u64 = 1_000;

/// A run into which this is planted at this level; the watchdog's oscillator runs at `lsi_hz`.
fn crash(what: &str, level: &str, lsi_hz: u32) -> Ran {
    let scenario = format!(
        "duration = \"4s\"\nlsi_hz = {lsi_hz}\n\
         t7 = [{{ address = 1, motion.ramp.rate = 10.0 }}, {{ address = 2, motion.constant = 20.0 }}]\n\
         isu = [{{ address = 1, motion.constant = 100.0 }}]\n\
         [[plant]]\nat = \"{AT_MS}ms\"\nwhat = \"{what}\"\nlevel = \"{level}\"\n"
    );
    run(&(scenario + &typed(3_200, "reset-cause") + &modbus::request(&START_BLOCK, 3_500)))
}

/// What console, Modbus port and log report of a crash.
struct Reported {
    cause: &'static str,
    code: u16,
    /// One of these; none if it is unknown.
    duties: &'static [&'static str],
    /// The exceptions that may have been active, if it is known: 0 is the main loop, 16 and up are interrupts.
    exceptions: Option<&'static [u16]>,
    within: u64,
}

/// Whose level is below the ports' interrupts: the first to be late is named.
const ALL_BELOW: &[&str] = &["t7_bus", "isu_bus", "pwm", "modbus"];

/// Checks the time it takes, and the three reports; returns how long the crash lasted and how long until the next angle.
fn check(name: &str, ran: &Ran, reset: ResetCause, told: &Reported) -> (u64, u64) {
    let resets = resets(ran);
    let [(at, cause)] = resets[..] else { panic!("{name}: {resets:?}") };
    assert_eq!(cause, reset, "{name}");
    let lasted = at - planted(ran);
    assert!(lasted <= told.within, "{name}: {lasted} ns");

    let [start] = said(ran, "start")[..] else { panic!("{name}: asked once") };
    let expected = format!(
        "{{\"what\":\"start\",\"cause\":\"{}\",\"boots\":2,\"crashes\":1,\"mode\":\"normal\",\"clock\":\"crystal\"}}",
        told.cause
    );
    assert_eq!(start, expected, "{name}");
    let [crash] = said(ran, "crash")[..] else { panic!("{name}: one crash") };
    assert!(crash.contains(&format!("\"cause\":\"{}\",\"boot\":1,", told.cause)), "{name}: {crash}");
    let duty = field(crash, "duty").trim_matches('"');
    assert!(told.duties.contains(&duty) || told.duties.is_empty() && duty == "null", "{name}: {crash}");
    let exception: Option<u16> = field(crash, "exception").parse().ok();
    match told.exceptions {
        Some(possible) => {
            assert!(exception.is_some_and(|number| possible.contains(&number)), "{name}: {crash}")
        }
        None => assert_eq!(exception, None, "{name}: {crash}"),
    }

    // Cause, mode, clock, crash's cause; starts, crashes, start of the crash.
    let exchanges = modbus::exchanges(&ran.bus_log);
    let registers = exchanges.last().and_then(|exchange| exchange.registers()).expect("an answer");
    assert_eq!(registers[..10], [told.code, 0, 0, told.code, 0, 2, 0, 1, 0, 1], "{name}");
    let pc = u32::from(registers[16]) << 16 | u32::from(registers[17]);
    let said_pc = field(crash, "pc").trim_matches('"');
    let said_pc = said_pc.strip_prefix("0x").and_then(|hex| u32::from_str_radix(hex, 16).ok());
    assert_eq!(pc, said_pc.unwrap_or(u32::MAX), "{name}: {crash}");

    let log =
        ran.log.iter().find(|line| line.contains("start 2")).unwrap_or_else(|| panic!("{name}: no log"));
    assert!(log.contains(told.cause), "{name}: {log}");

    // No angle is wrong, and they are back.
    assert!(!ran.summary.contains("readings are wrong"), "{name}: {}", ran.summary);
    let first = ran.slot(0).find(|spoken| spoken.began > at && spoken.is_ok()).expect("angles come again");
    assert!(ran.slot(0).last().is_some_and(|spoken| spoken.is_ok() && spoken.at > 3_500 * MS), "{name}");
    println!(
        "{name}: reset after {} ms, first angle {:.1} ms later",
        lasted / MS,
        (first.at - at) as f64 / 1e6
    );
    assert!(first.at - at <= 150 * MS, "{name}: {} ns to the first angle", first.at - at);
    (lasted, first.at - at)
}

/// The value of a field of a flat JSON object.
fn field<'a>(object: &'a str, name: &str) -> &'a str {
    let from = object.split(&format!("\"{name}\":")).nth(1).unwrap_or_else(|| panic!("{name} in {object}"));
    from.split([',', '}']).next().expect("a value")
}

fn stalled(level: &str, duties: &'static [&'static str], exceptions: &'static [u16], within: u64) {
    let ran = crash("hang", level, 32_000);
    let told = Reported { cause: "stalled", code: 8, duties, exceptions: Some(exceptions), within };
    check(&format!("hang of {level}"), &ran, ResetCause::Software, &told);
}

#[test]
fn a_hang_of_the_main_loop_ends_within_a_second() {
    // When the tick comes, an interrupt may be active on top of what hangs: EXTI0 or EXTI1, exceptions 22 and 23.
    stalled("main", &["console"], &[0, 22, 23], 930 * MS);
}

#[test]
fn a_hang_of_the_bus_level_ends_within_half_a_second() {
    // EXTI0 is interrupt 6, exception 22. The duties of its own level and of the one below it, Modbus, are late together.
    stalled("bus", ALL_BELOW, &[22], 530 * MS);
}

#[test]
fn a_hang_of_the_modbus_level_ends_within_half_a_second() {
    // EXTI1, exception 23.
    stalled("modbus", &["modbus"], &[23], 530 * MS);
}

#[test]
fn a_hang_of_a_ports_interrupt_ends_within_half_a_second() {
    // USART1 is interrupt 37, exception 53; nothing below its priority runs meanwhile.
    stalled("t7_port", ALL_BELOW, &[53], 530 * MS);
}

#[test]
fn a_hang_of_the_clocks_interrupt_ends_within_half_a_second() {
    // TIM4 is interrupt 30, exception 46.
    stalled("clock", ALL_BELOW, &[46], 530 * MS);
}

#[test]
fn with_interrupts_masked_the_watchdog_ends_it_within_a_second_and_a_half() {
    let mut shortest = u64::MAX;
    for lsi_hz in [17_000, 32_000, 47_000] {
        let ran = crash("masked_hang", "main", lsi_hz);
        let told = Reported { cause: "watchdog", code: 5, duties: &[], exceptions: None, within: 1_500 * MS };
        let name = format!("everything hangs, LSI {lsi_hz} Hz");
        shortest = check(&name, &ran, ResetCause::Watchdog, &told).0.min(shortest);
    }
    // Not so short that an erase would run into it.
    assert!(shortest > 510 * MS, "{shortest}");
}

#[test]
fn faults_say_what_they_are_and_where() {
    let faults: [(_, _, _, _, &[u16]); 4] = [
        ("data_fault", "bus", "bus_fault", 12, &[22]),
        ("data_fault", "modbus", "bus_fault", 12, &[23]),
        ("bus_fault", "main", "bus_fault", 12, &[0]),
        ("usage_fault", "isu_port", "usage_fault", 13, &[55]),
    ];
    for (what, level, cause, code, exceptions) in faults {
        let ran = crash(what, level, 32_000);
        let told = Reported { cause, code, duties: &[], exceptions: Some(exceptions), within: MS };
        check(&format!("{what} in {level}"), &ran, ResetCause::Software, &told);
        let crash = said(&ran, "crash")[0].to_owned();
        if what == "data_fault" {
            assert_eq!(field(&crash, "address"), "\"0x0a000000\"", "{crash}");
            assert_eq!(field(&crash, "cfsr"), "\"0x00008200\"", "PRECISERR, BFARVALID: {crash}");
        }
        // Escalated to HardFault: HFSR.FORCED.
        assert_eq!(field(&crash, "hfsr"), "\"0x40000000\"", "{crash}");
    }
}

#[test]
fn a_stack_that_overflows_meets_no_data() {
    let ran = crash("stack_overflow", "main", 32_000);
    let told = Reported { cause: "stack_overflow", code: 14, duties: &[], exceptions: None, within: MS };
    check("stack overflow", &ran, ResetCause::Software, &told);
}

#[test]
fn a_panic_says_where_it_was() {
    let ran = crash("panic", "main", 32_000);
    let told = Reported { cause: "panic", code: 9, duties: &[], exceptions: None, within: MS };
    check("panic", &ran, ResetCause::Software, &told);
    let crash = said(&ran, "crash")[0];
    assert!(
        field(crash, "file").ends_with(".rs\"") && field(crash, "line").parse::<u32>().is_ok(),
        "{crash}"
    );
}

#[test]
fn resets_from_outside_are_no_crashes() {
    for (what, cause, name) in
        [("brown_out", ResetCause::BrownOut, "brown_out"), ("pin_reset", ResetCause::Pin, "pin")]
    {
        let ran = crash(what, "main", 32_000);
        assert_eq!(resets(&ran).iter().map(|(_, cause)| *cause).collect::<Vec<_>>(), [cause]);
        let [start] = said(&ran, "start")[..] else { panic!("asked once") };
        assert!(start.contains(&format!("\"cause\":\"{name}\",\"boots\":2,\"crashes\":0,")), "{start}");
        assert_eq!(said(&ran, "crash"), [""; 0]);
        assert!(ran.slot(0).last().is_some_and(|spoken| spoken.is_ok() && spoken.at > 3_500 * MS));
    }
}

#[test]
fn the_longest_erase_is_no_hang() {
    // The fastest oscillator, a save that erases, a factory reset that erases all three sectors, and a save again.
    let lines = [(500, "save"), (1_500, "factory-reset --yes"), (3_500, "slot 1 off"), (3_700, "save")];
    let lines: String = lines.into_iter().map(|(at, line)| typed(at, line)).collect();
    let ran = run(&format!(
        "duration = \"6s\"\nlsi_hz = 47000\nt7 = [{{ address = 1, motion.constant = 1.0 }}]\n{lines}{}",
        typed(5_500, "reset-cause")
    ));
    assert_eq!(resets(&ran), []);
    assert_eq!(said(&ran, "saved"), [r#"{"what":"saved","stored":"written"}"#; 2]);
    assert!(said(&ran, "start")[0].contains(r#""boots":1,"crashes":0"#));
    assert!(ran.slot(0).last().is_some_and(|spoken| spoken.is_ok() && spoken.at > 5 * SECOND));
}
