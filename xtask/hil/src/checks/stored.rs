//! What is saved survives a reset, and the board is left as delivered.

use super::Bench;

/// A period that no slot has otherwise, ms.
const PERIOD_MS: u64 = 777;

pub fn check(bench: &mut Bench) -> Result<(), String> {
    bench.console.ask(&format!("set 0 period {PERIOD_MS}"))?;
    let saved = bench.console.ask_flash("save --yes", "stored");
    bench.report.check(
        "save",
        "written",
        saved.map(|object| (object["stored"].to_string(), object["stored"] == "written")),
        "the supply: below 2.7 V the flash is not programmed by words; write protection of sectors 1 to 3 (option bytes)",
    );
    let before = bench.console.ask("reset-cause")?;
    let boots = |answer: &[serde_json::Value]| answer.iter().find_map(|object| object["boots"].as_u64());
    bench.console.restart()?;
    let after = bench.console.ask("reset-cause")?;
    let cause = after.iter().find_map(|object| object["cause"].as_str()).unwrap_or("?").to_owned();
    let counted = boots(&before).zip(boots(&after)).is_some_and(|(before, after)| after == before + 1);
    bench.report.check(
        "reboot",
        "cause software, one start more",
        Ok((format!("cause {cause}, start {:?} after {:?}", boots(&after), boots(&before)), cause == "software" && counted)),
        "`reset-cause`; a supply that breaks down (brown_out, power_on); a reset pin without its capacitor (pin)",
    );
    let shown = bench.console.ask("show 0")?;
    let period = shown.iter().find_map(|object| object["period_ms"].as_f64());
    bench.report.check(
        "the saved setting after the reset",
        format!("period {PERIOD_MS} ms"),
        Ok((format!("period {period:?} ms"), period == Some(PERIOD_MS as f64))),
        "sectors 1 to 3: a tool that erases the whole chip at each start",
    );
    Ok(())
}

/// Discards what this run has saved.
pub fn leave_as_delivered(bench: &mut Bench) -> Result<(), String> {
    bench.console.ask_flash("factory-reset --yes", "done")?;
    bench.console.restart().map(|_| ())
}
