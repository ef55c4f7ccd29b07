//! The report of a task as outcome and reason.

use clino_gateway::task::{self, Reason, TaskEvent};

use crate::command::Outcome;

/// How the task has ended, and why it failed if it did; `None` if it goes on.
pub fn outcome(news: &TaskEvent) -> Option<(Outcome, Option<Reason>)> {
    if !news.is_end() {
        return None;
    }
    let reason = match news {
        TaskEvent::T7(task::t7::TaskEvent::Failed(failure)) => Reason::from(&failure.cause),
        TaskEvent::Isu(task::isu::TaskEvent::Failed(failure)) => Reason::from(&failure.cause),
        _ => return Some((Outcome::Done, None)),
    };
    let outcome = if reason == Reason::Cancelled { Outcome::Cancelled } else { Outcome::Failed };
    Some((outcome, Some(reason)))
}
