//! The monitor against the clock: it names a task at its deadline, not a tick earlier, and every task that hangs.

use clino_recovery::{MonitoredTask, TICK_MS, TaskMonitor};

/// Ticks until a task is named, and the task.
fn until_stalled(monitor: &TaskMonitor, most: u32) -> Option<(u32, MonitoredTask)> {
    (1..=most).find_map(|tick| monitor.tick().map(|task| (tick, task)))
}

#[test]
fn a_silent_task_is_named_within_its_deadline_and_two_ticks() {
    for (task, deadline_ms) in [
        (MonitoredTask::T7Bus, 500),
        (MonitoredTask::IsuBus, 500),
        (MonitoredTask::Pwm, 500),
        (MonitoredTask::Modbus, 500),
        (MonitoredTask::Console, 900),
        (MonitoredTask::Storage, 900),
    ] {
        let monitor = TaskMonitor::new();
        monitor.check_in(task);
        let (ticks, named) = until_stalled(&monitor, 1_000).expect("it is named");
        assert_eq!(named, task);
        assert!(ticks * TICK_MS >= deadline_ms, "{named:?} after {} ms", ticks * TICK_MS);
        assert!(ticks * TICK_MS <= deadline_ms + 2 * TICK_MS, "{named:?} after {} ms", ticks * TICK_MS);
        // It stays named: the watchdog is not fed again.
        assert_eq!(until_stalled(&monitor, 1), Some((1, task)));
    }
}

#[test]
fn everything_ends_within_a_second_and_a_half() {
    for task in MonitoredTask::ALL {
        assert!(task.longest_silence_ms() + 2 * TICK_MS <= 1_500 - 500, "{task:?}");
    }
}

#[test]
fn tasks_that_check_in_in_time_are_never_named() {
    let monitor = TaskMonitor::new();
    for tick in 0..100_000u32 {
        for task in MonitoredTask::ALL {
            if tick % (task.longest_silence_ms() / TICK_MS) == 0 {
                monitor.check_in(task);
            }
        }
        assert_eq!(monitor.tick(), None, "tick {tick}");
    }
}

#[test]
fn a_task_that_rests_is_not_expected() {
    let monitor = TaskMonitor::new();
    assert_eq!(until_stalled(&monitor, 10_000), None, "no task has checked in yet");
    monitor.check_in(MonitoredTask::Storage);
    monitor.tick();
    monitor.rest(MonitoredTask::Storage);
    assert_eq!(until_stalled(&monitor, 10_000), None);
}

#[test]
fn numbers_and_names_of_tasks_do_not_change() {
    let told = MonitoredTask::ALL.map(|task| (task as u8, task.name()));
    let expected = [(1, "t7_bus"), (2, "isu_bus"), (3, "pwm"), (4, "modbus"), (5, "console"), (6, "storage")];
    assert_eq!(told, expected);
    assert!(MonitoredTask::ALL.into_iter().all(|task| MonitoredTask::from_number(task as u32) == Some(task)));
    assert_eq!(MonitoredTask::from_number(0), None);
}
