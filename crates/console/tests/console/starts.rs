//! What the next start tells, and the operations refused in degraded modes.

use clino_gateway::DegradedMode;
use clino_recovery::{Clock, Crash, FaultStatus, Mode, MonitoredTask, Registers, Start, Uid};

use crate::desk::Desk;

#[test]
fn the_cause_of_the_start_is_told() {
    let said = Desk::new().type_in("reset-cause\r");
    let start =
        r#"{"what":"start","cause":"power_on","boots":1,"crashes":0,"mode":"normal","clock":"crystal"}"#;
    assert_eq!(said, format!("{start}\r\n"));
}

/// What is said of this crash, without the end of the line.
fn crash(crash: Crash) -> String {
    let mut desk = Desk::new();
    desk.rest.start = Start {
        cause: crash.cause,
        power_ups: 0,
        boots: 13,
        crashes: 3,
        mode: Mode::Safe,
        clock: Clock::Fallback,
        uid: Uid([0, 1, 2]),
        crash: Some(Crash { boot: 12, uptime_ms: 4_567, ..crash }),
    };
    let said = desk.type_in("reset-cause\r");
    let (start, crash) = said.split_once("\r\n").expect("two lines");
    assert!(start.ends_with(r#","boots":13,"crashes":3,"mode":"safe","clock":"fallback"}"#), "{start}");
    crash.strip_suffix("\r\n").expect("a line").into()
}

#[test]
fn the_last_crash_is_told_with_all_that_is_known_of_it() {
    let at = Registers { pc: 0x0801_A2B4, lr: 0xFFFF_FFF9, sp: 0x2000_0010, exception: 22 };
    assert_eq!(
        crash(Crash::fault(FaultStatus::new(0x8200, 0x4000_0000, 0, 0x2222_0001), Some(at), false)),
        concat!(
            r#"{"what":"crash","cause":"bus_fault","boot":12,"uptime_ms":4567"#,
            r#","duty":null,"file":null,"line":null"#,
            r#","pc":"0x0801a2b4","lr":"0xfffffff9","sp":"0x20000010","exception":22"#,
            r#","cfsr":"0x00008200","hfsr":"0x40000000","address":"0x22220001"}"#,
        )
    );
    assert_eq!(
        crash(Crash::stalled(MonitoredTask::IsuBus, Registers { exception: 0, ..at })),
        concat!(
            r#"{"what":"crash","cause":"stalled","boot":12,"uptime_ms":4567"#,
            r#","duty":"isu_bus","file":null,"line":null"#,
            r#","pc":"0x0801a2b4","lr":"0xfffffff9","sp":"0x20000010","exception":0"#,
            r#","cfsr":null,"hfsr":null,"address":null}"#,
        )
    );
    assert_eq!(
        crash(Crash::panic("src/x.rs", 71)),
        concat!(
            r#"{"what":"crash","cause":"panic","boot":12,"uptime_ms":4567"#,
            r#","duty":null,"file":"src/x.rs","line":71"#,
            r#","pc":null,"lr":null,"sp":null,"exception":null"#,
            r#","cfsr":null,"hfsr":null,"address":null}"#,
        )
    );
    // An undefined instruction accesses nothing.
    let undefined = crash(Crash::fault(FaultStatus::new(1 << 16, 0, 5, 6), None, false));
    assert!(undefined.contains(r#""cfsr":"0x00010000","hfsr":"0x00000000","address":null}"#), "{undefined}");
}

#[test]
fn what_is_restrained_is_refused_with_its_reason() {
    let mut desk = Desk::new();
    desk.rest.gateway.degrade(DegradedMode::InexactClock);
    for line in ["t7 damping 5 100 --yes", "isu address 3 4 --yes", "t7 baud 5 9600 --yes"] {
        let said = desk.type_in(&format!("{line}\r"));
        let begin = r#"{"error":{"kind":"inexact_clock","clock_off_percent":8,"most_percent":3.330,"why":""#;
        assert!(said.starts_with(begin), "{said}");
    }
    desk.rest.gateway.degrade(DegradedMode::NoBuses);
    let said = desk.type_in("t7 info 5\r");
    let why = r#"{"error":{"kind":"no_buses","why":"safe mode: the buses are not served"}}"#;
    assert_eq!(said, format!("{why}\r\n"));
    assert_eq!(desk.type_in("bus t7 -b 9600\r"), "{\"done\":true}\r\n");
    desk.rest.gateway.degrade(DegradedMode::InexactClock);
    assert_eq!(desk.type_in("t7 info 5\r"), "", "it is begun");
    // A person is told in words, once it is meant.
    desk.type_in("json off\r");
    desk.type_in("t7 damping 5 100\r");
    let said = desk.type_in("y\r");
    assert!(said.contains("error: the clock may be off by 8 %, a UART tolerates 3.330 %:"), "{said}");
}
