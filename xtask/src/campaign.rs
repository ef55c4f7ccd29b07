//! `cargo xtask campaign`: long runs of what the tests show in short. Their last results are in `docs/campaigns.md`.

use std::ops::RangeInclusive;

use crate::boards::{self, Board};
use crate::command::{Failure, Outcome};
use crate::firmware::{self, SHIPPED, Variant};
use crate::programs::{self, Programs};
use crate::steps::{self, Steps};
use crate::witness;

const HOW_TO_ADD: &str = "\
To add one: let the environment raise the size of a test (CLINO_...: a number of scripts, of days, a seed), and make
the daily size its default: `cargo xtask test` runs that. A test that cannot be made short is #[ignore]d; a campaign
runs ignored tests, too. Add a line to CAMPAIGNS in xtask/src/campaign.rs, which raises it, and one to
docs/campaigns.md.";

/// A long run.
struct Campaign {
    name: &'static str,
    /// What it shows, and how long it takes on a quiet machine.
    shows: &'static str,
    runs: &'static [Run],
}

/// A variable of the environment and its value.
type Variable = (&'static str, &'static str);

/// A part of a campaign.
enum Run {
    /// A script and its arguments.
    Script(&'static str, &'static [&'static str]),
    /// Tests of a program, as `cargo nextest` names it, whose names have this in them, in this environment.
    Tests(&'static str, &'static str, &'static [Variable]),
    /// The same once for each seed, which is in the variable that is named last.
    Seeds(&'static str, &'static str, &'static [Variable], &'static str, RangeInclusive<u32>),
    /// All tests of a program on the image for another board.
    On(Board, &'static str),
    /// The comparison of the two cores: random sequences, calls of each function of the image, seed.
    Cores([&'static str; 3]),
}

use Run::{Cores, On, Script, Seeds, Tests};

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
        name: "examples",
        shows: "all example programs, in the repository and from the packages; every wait of an ISU's set-up dropped (20 min)",
        runs: &[
            Script("crates/drivers/checks/examples.sh", &[]),
            Script("crates/drivers/checks/package.sh", &[]),
            Tests("clino-drivers::run", "an_eeprom_survives", &[("CLINO_EVERY_WAIT", "1")]),
        ],
    },
    Campaign {
        name: "published",
        shows: "licences, origins and public interface of the crates that others use; installs what that takes (the first time 10 min)",
        runs: &[
            Script("crates/drivers/checks/deny.sh", &["--install"]),
            Script("crates/drivers/checks/semver.sh", &["--install"]),
        ],
    },
    Campaign {
        name: "altered",
        shows: "a million damaged scripts at the console, five ways each, and a thousand at the shipped image (35 min)",
        runs: &[
            Tests("clino-console::console", "altered::", &[("CLINO_SCRIPTS", "1000000")]),
            Tests("clino-host-tests::board", "altered::", &[("CLINO_ALTERED_RUNS", "125")]),
        ],
    },
    Campaign {
        name: "commissioning",
        shows: "the power cut at every character of an ISU's set-up and repair (3 min)",
        runs: &[Tests("clino-commissioning::isu_power_cut", "every_character", &[])],
    },
    Campaign {
        name: "pc",
        shows: "the PC tool killed at every frame of a change of address, and its log a thousand times (20 min)",
        runs: &[
            Tests("clino::bus", "killed::", &[("CLINO_PC_KILLS", "all")]),
            Tests("clino::bus", "log::killed", &[("CLINO_LOG_KILLS", "1000")]),
        ],
    },
    Campaign {
        name: "fleet",
        shows: "300 gateways on one broker: loss, times, load; an hour without the broker; the page (10 min, 10 GB)",
        // One after the other: each measures what a computer with nothing else to do can.
        runs: &[Tests("clino::fleet", "load::", &[("RUST_TEST_THREADS", "1")])],
    },
    Campaign {
        name: "storage",
        shows: "the power cut at every word of saves, every seed (5 min)",
        runs: &[Tests("clino-storage::power", "campaign", &[])],
    },
    Campaign {
        name: "publication",
        shows: "every ISU code, PWM tick and T7 angle with every soft zero, as published (10 min)",
        runs: &[Tests("clino-gateway", "publication::sweep", &[("CLINO_EVERY_ANGLE", "1")])],
    },
    Campaign {
        name: "core",
        shows: "thirty days of the gateway core, six seeds; a day, twice the same (35 min)",
        runs: &[
            Seeds("clino-gateway", "days_with_faults", &[("CLINO_DAYS", "30")], "CLINO_SEED", 1..=6),
            Tests("clino-gateway", "twenty_four_hours", &[]),
        ],
    },
    Campaign {
        name: "cpu",
        shows: "a million random instruction sequences and the image's functions on two cores (30 min)",
        runs: &[Cores(["1000000", "10", "2"])],
    },
    Campaign {
        name: "power",
        shows: "the power cut at every step of the shipped image's saves (30 min)",
        runs: &[Tests("clino-host-tests::recovery", "a_cut_in_any_step", &[("CLINO_EVERY_CUT", "1")])],
    },
    Campaign {
        name: "soak",
        shows: "ten minutes of the shipped image with everything at once, four seeds (2 h)",
        runs: &[Seeds(
            "clino-host-tests::soak",
            "everything",
            &[("CLINO_SOAK_MINUTES", "10")],
            "CLINO_SOAK_SEED",
            1..=4,
        )],
    },
    Campaign {
        name: "nucleo",
        shows: "all tests of the image on that for the NUCLEO-F446RE (40 min)",
        runs: &[
            On(boards::NUCLEO, "clino-host-tests::board"),
            On(boards::NUCLEO, "clino-host-tests::recovery"),
            On(boards::NUCLEO, "clino-host-tests::clients"),
            On(boards::NUCLEO, "clino-host-tests::soak"),
        ],
    },
];

/// Runs the named campaigns; without a name, lists them.
pub fn run(names: &[String]) -> Outcome {
    if names.is_empty() {
        println!("Campaigns:\n{}\n\n{HOW_TO_ADD}", known());
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
    let runs = || wanted.iter().flat_map(|campaign| campaign.runs);
    let has_cores = runs().any(|run| matches!(run, Cores(_)));
    if has_cores || runs().filter_map(Run::program).any(|program| program.starts_with("clino-host-tests")) {
        let boards = runs().filter_map(Run::board).map(Variant::of);
        let mut images = vec![SHIPPED];
        images.extend(boards);
        images.dedup();
        firmware::build_all(steps, &images)?;
    }
    if has_cores {
        witness::install(steps)?;
    }
    // Scripts build what they need themselves.
    let built =
        if runs().any(|run| run.program().is_some()) { Some(Programs::optimised(steps)?) } else { None };
    for campaign in wanted {
        for run in campaign.runs {
            run.add_to(steps, campaign.name, built.as_ref())?;
        }
    }
    Ok(())
}

impl Run {
    /// The test program that it needs.
    fn program(&self) -> Option<&'static str> {
        match self {
            Script(..) | Cores(_) => None,
            Tests(program, ..) | Seeds(program, ..) | On(_, program) => Some(program),
        }
    }

    /// The board whose image it needs, besides the shipped one.
    fn board(&self) -> Option<Board> {
        match self {
            On(board, _) => Some(*board),
            _ => None,
        }
    }

    /// Runs it, as steps whose names begin with the campaign's.
    fn add_to(&self, steps: &mut Steps, name: &str, built: Option<&Programs>) -> Outcome {
        let tests = |program: &str, test: &str, environment: &[Variable]| {
            let built = built.ok_or_else(|| Failure::new("the test programs are not built"))?;
            let program = built.test(program)?;
            program.must_have(test)?;
            let mut command = program.command();
            command.args(["--include-ignored", "--nocapture", test]).envs(environment.iter().copied());
            Ok::<_, Failure>(command)
        };
        match self {
            Script(path, arguments) => steps.run(name, steps::script(path, arguments)),
            Cores(numbers) => steps.run(name, witness::cpu(numbers)),
            Tests(program, test, environment) => {
                steps.run(&format!("{name} {test}"), tests(program, test, environment)?);
            }
            On(board, program) => {
                let built = built.ok_or_else(|| Failure::new("the test programs are not built"))?;
                let mut command = built.test(program)?.command();
                programs::with_image(&mut command, Variant::of(*board));
                steps.run(&format!("{name} {program}"), command);
            }
            Seeds(program, test, environment, variable, seeds) => {
                for seed in seeds.clone() {
                    let mut command = tests(program, test, environment)?;
                    command.env(variable, seed.to_string());
                    steps.run(&format!("{name} {test} {seed}"), command);
                }
            }
        }
        Ok(())
    }
}

fn known() -> String {
    let line = |campaign: &Campaign| format!("  {:<14}{}", campaign.name, campaign.shows);
    CAMPAIGNS.iter().map(line).collect::<Vec<_>>().join("\n")
}
