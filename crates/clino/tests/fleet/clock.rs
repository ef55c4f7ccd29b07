//! The computer's clock jumps: by `libfaketime`, which tells the tool another time than the computer's.

use std::process::Command;

use clino_testkit::programs::{Faketime, skipped};

use crate::away::outcomes;
use crate::broker::{Broker, Heard, mosquitto};
use crate::gateway::Gateway;
use crate::metrics::get;
use crate::program::{CLINO, Program};
use crate::{folder, free_port, now_ms, until};

const HOUR_S: i64 = 3_600;
/// What a busy computer may be late by.
const LATE_MS: i64 = 30_000;

#[test]
fn a_clock_that_jumps_is_told_and_order_and_numbers_stay() {
    const TEST: &str = "fleet clock";
    let Some(mosquitto) = mosquitto(TEST) else { return };
    let faketime = match Faketime::get(crate::programs()) {
        Ok(faketime) => faketime,
        Err(why) => return skipped(TEST, &why),
    };
    let folder = folder("clock");
    let broker = Broker::start(&mosquitto, &folder);
    let heard = broker.listen(&mosquitto);
    let (gateway, metrics) = (Gateway::new(), free_port());
    let text = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[mqtt]\nhost = \"127.0.0.1\"\nport = {}\n\
         [store]\nfolder = \"{}\"\n[prometheus]\nlisten = \"127.0.0.1:{metrics}\"\n",
        gateway.endpoint(),
        broker.port(),
        folder.display()
    );
    let (file, clock) = (folder.join("bridge.toml"), folder.join("clock"));
    std::fs::write(&file, text).expect("a folder of this test");
    // The file is replaced as a whole: half a number would be a jump, too.
    let set = |offset_s: i64| {
        let new = folder.join("clock.new");
        std::fs::write(&new, format!("{offset_s:+}\n")).expect("a folder of this test");
        std::fs::rename(new, &clock).expect("a folder of this test");
    };
    set(0);
    let mut command = Command::new(CLINO);
    command.args(["bridge", "--config"]).arg(&file);
    faketime.apply(&mut command, &clock);
    let bridge = Program::run(&folder, command);
    gateway.wait_for(1);
    gateway.end_line();
    let mut told = 0;
    // A value that was measured a second ago, by the clock that the tool is given.
    let mut tell_until_it_is = |offset_s: i64| {
        until("a value by the new clock", || {
            told += 1;
            gateway.angle(0, "1.000", 1_000, told);
            let last = heard.of("clino/north/state").last()?.json();
            let late = now_ms() + offset_s * 1_000 - last["values"][0]["ts"].as_i64()?;
            (1_000..1_000 + LATE_MS).contains(&late).then_some(())
        });
    };
    tell_until_it_is(0);
    for (offset_s, jump_s) in [(HOUR_S, HOUR_S), (-HOUR_S, -2 * HOUR_S)] {
        set(offset_s);
        tell_until_it_is(offset_s);
        let event = heard.wait("clino/bridge/bridge/event", |event| {
            event["event"] == "clock_jumped"
                && event["by_ms"].as_i64().is_some_and(|by| (by - jump_s * 1_000).abs() < LATE_MS)
        });
        let told_at = event["ts"].as_i64().expect("a number");
        assert!((now_ms() + offset_s * 1_000 - told_at).abs() < LATE_MS, "{event}");
        let said = format!("has jumped by {}", if jump_s < 0 { "-7" } else { "3" });
        until("a line about it", || Some(bridge.errors()).filter(|errors| errors.contains(&said)));
        tell_until_it_is(offset_s);
    }
    until("the counter", || {
        get(metrics, "/metrics").filter(|(_, text)| text.contains("clino_clock_jumps_total 2\n"))
    });
    // Nothing is missing, nothing came twice, and numbers ascend, whatever the clock said.
    let batches: Vec<_> = heard.of("clino/north/state").iter().map(Heard::json).collect();
    let numbers: Vec<_> = batches.iter().map(|batch| batch["seq"].as_u64().expect("a number")).collect();
    assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]), "{numbers:?}");
    let got = outcomes(&heard.all());
    assert!(got.windows(2).all(|pair| pair[1] == pair[0] + 1), "{got:?}");
    assert!(bridge.end().success());
}
