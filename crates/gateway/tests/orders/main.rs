//! Orders have an order: a real gateway with simulated sensors, and those who order at any time.

mod model;
mod sequence;
mod site;
