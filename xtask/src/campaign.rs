//! `cargo xtask campaign`: long runs of what the tests show in short. Their last results are in `docs/campaigns.md`.
//!
//! **To add one**: give the test a size that the environment can raise (`CLINO_…`: a number of scripts, days, seeds), with
//! the daily size as its default, so that `cargo xtask test` runs the short form every day; add a [`Campaign`] to
//! [`CAMPAIGNS`] that raises it; add a line to `docs/campaigns.md`.

use crate::command::{self, Failure, Outcome};
use crate::firmware;
use crate::programs::Programs;
use crate::steps::Steps;

/// A long run.
struct Campaign {
    name: &'static str,
    /// What it shows, and how long it takes on a quiet machine.
    shows: &'static str,
    runs: &'static [Run],
}

/// A step of a campaign.
enum Run {
    /// A script and its arguments.
    Script(&'static str, &'static [&'static str]),
    /// Tests of a program, as `cargo nextest` names it, whose names have this in them, in this environment.
    Tests(&'static str, &'static str, &'static [(&'static str, &'static str)]),
}

use Run::{Script, Tests};

const CAMPAIGNS: &[Campaign] = &[
    Campaign {
        name: "codec",
        shows: "every T7 header, every angle payload (5 min)",
        runs: &[Script("crates/codec/checks/campaign.sh", &[])],
    },
    Campaign {
        name: "miri",
        shows: "the codec under Miri, both byte orders (10 min)",
        runs: &[Script("crates/codec/checks/miri.sh", &[])],
    },
    Campaign {
        name: "fuzz",
        shows: "every decoder, parser and store with other random input each time (30 min)",
        runs: &[Script("fuzz/checks/fuzz.sh", &["300", "0"])],
    },
    Campaign {
        name: "commissioning",
        shows: "the power cut at every character of an ISU's set-up and repair (3 min)",
        runs: &[Tests("clino-commissioning::isu_power_cut", "every_character", &[])],
    },
    Campaign {
        name: "storage",
        shows: "the power cut at every word of saves, every seed (5 min)",
        runs: &[Tests("clino-storage::power", "campaign", &[])],
    },
    Campaign {
        name: "core",
        shows: "thirty days of the gateway core, five seeds (30 min)",
        runs: &[
            Tests("clino-gateway", "thirty_days", &[("CLINO_SEED", "2")]),
            Tests("clino-gateway", "thirty_days", &[("CLINO_SEED", "3")]),
            Tests("clino-gateway", "thirty_days", &[("CLINO_SEED", "4")]),
            Tests("clino-gateway", "thirty_days", &[("CLINO_SEED", "5")]),
            Tests("clino-gateway", "thirty_days", &[("CLINO_SEED", "6")]),
        ],
    },
    Campaign {
        name: "power",
        shows: "the power cut at every step of the shipped image's saves (30 min)",
        runs: &[Tests("clino-host-tests::recovery", "a_cut_in_any_step", &[("CLINO_EVERY_CUT", "1")])],
    },
    Campaign {
        name: "soak",
        shows: "ten minutes of the shipped image with everything at once, three seeds (1.5 h)",
        runs: &[
            Tests("clino-host-tests::soak", "ten_minutes", &[("CLINO_SOAK_SEED", "2")]),
            Tests("clino-host-tests::soak", "ten_minutes", &[("CLINO_SOAK_SEED", "3")]),
            Tests("clino-host-tests::soak", "ten_minutes", &[("CLINO_SOAK_SEED", "4")]),
        ],
    },
];

/// Runs the named campaigns; without a name, lists them.
pub fn run(names: &[String]) -> Outcome {
    if names.is_empty() {
        println!("Campaigns:\n{}", known());
        return Ok(());
    }
    let find = |name: &String| {
        CAMPAIGNS.iter().find(|campaign| campaign.name == name).ok_or_else(|| {
            let message = format!("there is no campaign `{name}`, only:\n{}", known());
            Failure { message, status: crate::BAD_USAGE }
        })
    };
    let wanted = names.iter().map(find).collect::<Result<Vec<&Campaign>, Failure>>()?;
    let mut steps = Steps::new("campaign");
    let planned = all(&mut steps, &wanted);
    steps.end(planned)
}

fn all(steps: &mut Steps, wanted: &[&Campaign]) -> Outcome {
    let is_image_test =
        |run: &Run| matches!(run, Tests(program, ..) if program.starts_with("clino-host-tests"));
    if wanted.iter().any(|campaign| campaign.runs.iter().any(is_image_test)) {
        firmware::build(steps)?;
    }
    let programs = if wanted.iter().any(|campaign| campaign.runs.iter().any(|run| matches!(run, Tests(..)))) {
        Some(Programs::build(steps)?)
    } else {
        None
    };
    for campaign in wanted {
        for (number, run) in campaign.runs.iter().enumerate() {
            let command = match (run, &programs) {
                (Tests(program, test, environment), Some(programs)) => {
                    let mut command = programs.test(program)?.command();
                    command
                        .args(["--include-ignored", "--nocapture", test])
                        .envs(environment.iter().copied());
                    command
                }
                (Tests(..), None) => continue,
                (Script(path, arguments), _) => command::script(path, arguments),
            };
            let name = match campaign.runs {
                [_] => campaign.name.to_owned(),
                _ => format!("{} {}", campaign.name, number + 1),
            };
            steps.run(&name, command);
        }
    }
    Ok(())
}

fn known() -> String {
    let line = |campaign: &Campaign| format!("  {:<14}{}", campaign.name, campaign.shows);
    CAMPAIGNS.iter().map(line).collect::<Vec<_>>().join("\n")
}
