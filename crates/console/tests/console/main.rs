//! What is typed, and what comes back.

mod ahead;
mod alarms;
mod altered;
mod desk;
mod echo;
mod export;
mod orders;
mod people;
mod programs;
mod reference;
mod slots;
mod starts;
mod terminals;
