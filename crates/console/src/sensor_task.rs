//! A task on a sensor, until it is ordered: an [`Order`] has room for all settings of a slot, and is too large to wait.

use clino_gateway::Bus;
use clino_gateway::order::Order;
use clino_gateway::task::{isu, t7};

/// A task on a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorTask {
    T7(t7::Task),
    Isu(isu::Task),
}

impl SensorTask {
    /// The bus of the sensor.
    pub const fn bus(&self) -> Bus {
        match self {
            SensorTask::T7(_) => Bus::T7,
            SensorTask::Isu(_) => Bus::Isu,
        }
    }

    /// The order to the gateway.
    pub const fn order(self) -> Order {
        match self {
            SensorTask::T7(task) => Order::T7(task),
            SensorTask::Isu(task) => Order::Isu(task),
        }
    }
}
