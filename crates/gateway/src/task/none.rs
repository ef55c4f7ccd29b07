//! In the place of the tasks in a build without commissioning: none is ever begun.

use core::convert::Infallible;

use clino_bus::{Isu, Serial, T7};

use super::{Claim, TaskEvent, TaskRunner, Tasks, isu, t7};

macro_rules! no_tasks {
    ($protocol:ty, $task:ty) => {
        impl Tasks for $protocol {
            type Task = $task;
            type Work = Infallible;

            /// Not called: no task is accepted.
            fn begin(_: &$task, _: Serial, _: &mut Option<Infallible>) -> Result<(), TaskEvent> {
                Ok(())
            }

            fn claim(_: &$task) -> Claim {
                Claim::Nothing
            }

            fn runner(work: &mut Infallible) -> &mut TaskRunner<$protocol> {
                match *work {}
            }

            fn runner_ref(work: &Infallible) -> &TaskRunner<$protocol> {
                match *work {}
            }
        }
    };
}

no_tasks!(T7, t7::Task);
no_tasks!(Isu, isu::Task);
