//! The report of a task as outcome and reason.

use clino_gateway::task::{self, News, Reason};

use crate::command::Outcome;

/// How the task has ended, and why it failed if it did; `None` if it goes on.
pub fn outcome(news: &News) -> Option<(Outcome, Option<Reason>)> {
    if !news.is_end() {
        return None;
    }
    let reason = match news {
        News::T7(task::t7::News::Failed(failure)) => Reason::from(&failure.cause),
        News::Isu(task::isu::News::Failed(failure)) => Reason::from(&failure.cause),
        _ => return Some((Outcome::Done, None)),
    };
    let outcome = if reason == Reason::Cancelled { Outcome::Cancelled } else { Outcome::Failed };
    Some((outcome, Some(reason)))
}
