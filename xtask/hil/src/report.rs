//! The report: what was expected, what was measured, and where to look for what differs.

use std::fmt::Write as _;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::arguments::Arguments;

/// How a check ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// As expected.
    Passed,
    /// Not; and what to look at.
    Failed(&'static str),
    /// Not made, and why.
    Skipped(String),
}

/// A line of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    pub what: String,
    pub expected: String,
    pub measured: String,
    pub verdict: Verdict,
}

/// Everything so far.
#[derive(Debug, Default)]
pub struct Report {
    rows: Vec<Row>,
    /// What identifies the board and the image.
    pub identity: Vec<String>,
    /// The commands that make the settings that were stored before.
    pub settings: Vec<String>,
    /// The first lines of the log.
    pub log: Vec<String>,
    /// What has ended the run early.
    broken: Option<String>,
}

impl Report {
    /// Notes a check: what was measured, and whether it is as expected; or why nothing was measured.
    pub fn check(
        &mut self,
        what: impl Into<String>,
        expected: impl Into<String>,
        measured: Result<(String, bool), String>,
        look_at: &'static str,
    ) {
        let (measured, good) = measured.unwrap_or_else(|why| (why, false));
        let verdict = if good { Verdict::Passed } else { Verdict::Failed(look_at) };
        self.add(Row { what: what.into(), expected: expected.into(), measured, verdict });
    }

    /// Notes a check that cannot be made here.
    pub fn skip(&mut self, what: impl Into<String>, why: impl Into<String>) {
        let verdict = Verdict::Skipped(why.into());
        self.add(Row { what: what.into(), expected: String::new(), measured: String::new(), verdict });
    }

    fn add(&mut self, row: Row) {
        eprintln!("{}", shown(&row));
        self.rows.push(row);
    }

    /// What has ended the run early.
    pub fn broke_off(&mut self, why: &str) {
        self.broken = Some(why.to_owned());
    }

    /// How many checks failed.
    pub fn failed(&self) -> usize {
        self.count(|verdict| matches!(verdict, Verdict::Failed(_)))
    }

    fn count(&self, of: impl Fn(&Verdict) -> bool) -> usize {
        self.rows.iter().filter(|row| of(&row.verdict)).count()
    }

    /// As a page.
    pub fn markdown(&self, arguments: &Arguments) -> String {
        let mut page = String::new();
        // Writing to a string cannot fail.
        let mut line = |text: String| _ = writeln!(page, "{text}");
        let title = match (arguments.on_virtual_board, arguments.on_qemu) {
            (true, _) => "The virtual board",
            (_, true) => "QEMU",
            _ => "The board",
        };
        line(format!("# {title}\n"));
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
        line(format!("- board: {}", arguments.board));
        line(format!("- run: {seconds} s since 1970"));
        self.identity.iter().for_each(|identity| line(format!("- {identity}")));
        let passed = self.count(|verdict| *verdict == Verdict::Passed);
        let skipped = self.count(|verdict| matches!(verdict, Verdict::Skipped(_)));
        line(format!("- {passed} passed, {} failed, {skipped} skipped", self.failed()));
        if let Some(why) = &self.broken {
            line(format!("- **broken off**: {why}"));
        }
        line("\n| check | expected | measured | |\n|---|---|---|---|".to_owned());
        for Row { what, expected, measured, verdict } in &self.rows {
            let verdict = match verdict {
                Verdict::Passed => "ok".to_owned(),
                Verdict::Failed(look_at) => format!("**FAILED**: {look_at}"),
                Verdict::Skipped(why) => format!("skipped: {why}"),
            };
            line(format!("| {} | {} | {} | {verdict} |", cell(what), cell(expected), cell(measured)));
        }
        for (title, lines) in [("Log", &self.log), ("Settings before", &self.settings)] {
            if !lines.is_empty() {
                line(format!("\n## {title}\n\n```text\n{}\n```", lines.join("\n")));
            }
        }
        page
    }
}

fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}

fn shown(row: &Row) -> String {
    let Row { what, expected, measured, verdict } = row;
    match verdict {
        Verdict::Passed => format!("ok       {what}: {measured}"),
        Verdict::Failed(look_at) => {
            format!("FAILED   {what}: {measured}, expected {expected}\n         look at: {look_at}")
        }
        Verdict::Skipped(why) => format!("skipped  {what}: {why}"),
    }
}
