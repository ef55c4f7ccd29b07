//! What a task tells, in one word.

use clino_commissioning::{isu, t7};
use clino_gateway::task::{self, News};

use crate::command::Outcome;

/// How the task has ended; `None` if it goes on.
pub fn outcome(news: &News) -> Option<Outcome> {
    if !news.is_end() {
        return None;
    }
    Some(match news {
        News::T7(task::t7::News::Failed(t7::Failure { cause: t7::Cause::Cancelled, .. }))
        | News::Isu(task::isu::News::Failed(isu::Failure { cause: isu::Cause::Cancelled, .. })) => {
            Outcome::Cancelled
        }
        News::T7(task::t7::News::Failed(_)) | News::Isu(task::isu::News::Failed(_)) => Outcome::Failed,
        _ => Outcome::Done,
    })
}
