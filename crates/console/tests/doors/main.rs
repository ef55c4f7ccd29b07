//! What the console can, Modbus can, and the other way round: each command of the list is given through both doors and ends
//! in the same; what one door tells, the other does. What only one can has its name and its reason here.

mod commands;
mod fields;
mod house;
mod list;
