//! `cargo xtask campaign`: long runs of what the tests show in short. Their last results are in `docs/campaigns.md`.

use std::process::Command;

use crate::command::{self, Failure, Outcome};
use crate::firmware;

/// A long run.
struct Campaign {
    name: &'static str,
    shows: &'static str,
    run: fn() -> Outcome,
}

const CAMPAIGNS: &[Campaign] = &[
    Campaign {
        name: "codec",
        shows: "every T7 header, every angle payload (5 min)",
        run: || script("crates/codec/checks/campaign.sh", &[]),
    },
    Campaign {
        name: "miri",
        shows: "the codec under Miri, both byte orders (10 min)",
        run: || script("crates/codec/checks/miri.sh", &[]),
    },
    Campaign {
        name: "fuzz",
        shows: "every decoder, parser and store with other random input each time (30 min)",
        run: || script("fuzz/checks/fuzz.sh", &["300", "0"]),
    },
    Campaign {
        name: "altered",
        shows: "a million damaged scripts at the console, five ways each, and a thousand at the shipped image (2 h)",
        run: || {
            let mut cargo =
                command::cargo(["test", "--release", "--package", "clino-console", "--test", "console"]);
            cargo.args(["--", "--nocapture", "altered::"]).env("CLINO_SCRIPTS", "1000000");
            command::run(cargo)?;
            board("board", &["altered::"], &[("CLINO_ALTERED_RUNS", "125")])
        },
    },
    Campaign {
        name: "commissioning",
        shows: "the power cut at every character of an ISU's set-up and repair (3 min)",
        run: || tests("clino-commissioning", "isu_power_cut", ""),
    },
    Campaign {
        name: "storage",
        shows: "the power cut at every word of saves, every seed (5 min)",
        run: || tests("clino-storage", "power", "campaign"),
    },
    Campaign {
        name: "core",
        shows: "thirty days of the gateway core, five seeds (30 min)",
        run: || {
            (2..=6).try_for_each(|seed: u32| {
                let mut cargo = command::cargo(["test", "--package", "clino-gateway", "--lib", "--"]);
                cargo.args(["--ignored", "--nocapture", "thirty_days"]).env("CLINO_SEED", seed.to_string());
                command::run(cargo)
            })
        },
    },
    Campaign {
        name: "power",
        shows: "the power cut at every step of the shipped image's saves (30 min)",
        run: || board("recovery", &["a_cut_in_any_step"], &[("CLINO_EVERY_CUT", "1")]),
    },
    Campaign {
        name: "soak",
        shows: "ten minutes of the shipped image with everything at once, three seeds (1.5 h)",
        run: || {
            ["2", "3", "4"]
                .into_iter()
                .try_for_each(|seed| board("soak", &["ten_minutes"], &[("CLINO_SOAK_SEED", seed)]))
        },
    },
];

/// Runs the named campaigns.
pub fn run(names: &[String]) -> Outcome {
    let known = || {
        let line = |campaign: &Campaign| format!("  {:<14}{}", campaign.name, campaign.shows);
        CAMPAIGNS.iter().map(line).collect::<Vec<_>>().join("\n")
    };
    if names.is_empty() {
        println!("Campaigns:\n{}", known());
        return Ok(());
    }
    for name in names {
        let Some(campaign) = CAMPAIGNS.iter().find(|campaign| campaign.name == name) else {
            let message = format!("there is no campaign `{name}`, only:\n{}", known());
            return Err(Failure { message, status: crate::BAD_USAGE });
        };
        (campaign.run)()?;
    }
    Ok(())
}

fn script(path: &str, arguments: &[&str]) -> Outcome {
    let mut script = Command::new("sh");
    script.arg(path).args(arguments).current_dir(command::root());
    script.env("CARGO_TARGET_DIR", command::target_dir());
    command::run(script)
}

/// The ignored tests of a package whose names have this in them.
fn tests(package: &str, target: &str, name: &str) -> Outcome {
    let mut cargo = command::cargo(["test", "--package", package, "--test", target, "--"]);
    cargo.args(["--ignored", "--nocapture"]).args(Some(name).filter(|name| !name.is_empty()));
    command::run(cargo)
}

/// Tests of the shipped image.
fn board(suite: &str, names: &[&str], environment: &[(&str, &str)]) -> Outcome {
    let elf = firmware::build()?;
    let mut tests = firmware::suite(&elf, suite);
    tests.arg("--").arg("--nocapture").args(names).envs(environment.iter().copied());
    command::run(tests)
}
