//! All ways through one function: how deep its stack gets, and how deep it is at each call.
//!
//! The stack pointer is followed from instruction to instruction. Two ways that meet must bring the same depth; what moves
//! the stack pointer by an amount that is not in the instruction is an error, not a guess. Behind a call that does not
//! return, the way ends.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use crate::Error;
use crate::elf::{Function, Image, THUMB};
use crate::instruction::{Flow, Instruction, Stack};

/// Whom a function calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// The function at this address.
    Function(u32),
    /// One whose address is in a register.
    Indirect,
}

/// A call, or a jump that ends the function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Call {
    /// Address of the instruction.
    pub at: u32,
    /// Bytes the caller has on the stack then.
    pub depth: u32,
    /// Whom.
    pub target: Target,
}

/// What one function does to the stack.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Most bytes it has on the stack itself.
    pub size: u32,
    /// Calls that can be reached.
    pub calls: Vec<Call>,
    /// Whether it takes another stack; nothing of it counts for the one it was called on.
    pub takes_another_stack: bool,
    /// Whether it reads or writes floating-point registers.
    pub floating: bool,
    /// Whether it comes back.
    pub returns: bool,
    /// Bytes on the stack before each instruction that can be reached.
    pub depths: BTreeMap<u32, u32>,
    /// Bytes between the stack pointer at entry and the frame pointer, where there is one.
    pub frame_pointer: Option<u32>,
}

/// The frames of all functions of an image, by address.
pub fn all(image: &Image, code: &BTreeMap<u32, Instruction>) -> Result<BTreeMap<u32, Frame>, Error> {
    // No function returns until shown to: a function does if a way to a return goes through functions that do.
    let mut returning = BTreeSet::new();
    loop {
        let mut frames = BTreeMap::new();
        for (&address, function) in &image.functions {
            frames.insert(address, walk(image, code, function, &returning)?);
        }
        let now: BTreeSet<u32> =
            frames.iter().filter(|(_, frame)| frame.returns).map(|(&address, _)| address).collect();
        if now == returning {
            return Ok(frames);
        }
        returning = now;
    }
}

/// Follows one function.
fn walk(
    image: &Image,
    code: &BTreeMap<u32, Instruction>,
    function: &Function,
    returning: &BTreeSet<u32>,
) -> Result<Frame, Error> {
    let mut frame = Frame::default();
    let mut ahead = vec![(function.body.start, 0)];
    let wrong = |at: u32, what: &str| Error::new(format!("{}: {what} at {at:#010x}", function.name()));
    while let Some((at, depth)) = ahead.pop() {
        if let Some(&known) = frame.depths.get(&at) {
            if known != depth {
                return Err(wrong(at, "two ways meet with different depths of stack"));
            }
            continue;
        }
        frame.depths.insert(at, depth);
        let instruction = code.get(&at).ok_or_else(|| wrong(at, "there is no instruction"))?;
        frame.floating |= instruction.floating;
        if instruction.condition.is_some() && instruction.stack != Stack::Same {
            // Not executed, the stack stays as it is.
            let (next, instead) = conditional_return(image, code, at, depth).ok_or_else(|| {
                wrong(at, "the stack pointer is moved under a condition, but not to return")
            })?;
            frame.returns |= instead.is_none_or(|to| returning.contains(&to));
            frame.calls.extend(instead.map(|to| Call { at, depth: 0, target: Target::Function(to) }));
            ahead.push((next, depth));
            continue;
        }
        let call = |target| Call { at, depth, target };
        let after = match instruction.stack {
            Stack::Same => depth,
            Stack::Down(bytes) => depth
                .checked_add_signed(bytes)
                .ok_or_else(|| wrong(at, "more is taken off the stack than was put there"))?,
            Stack::Another if depth == 0 => {
                frame.takes_another_stack = true;
                0
            }
            Stack::Another | Stack::Unknown => {
                let what = format!("`{}` moves the stack pointer by an unknown amount", instruction.text);
                return Err(wrong(at, &what));
            }
        };
        frame.size = frame.size.max(after);
        if let Some(above) = instruction.frame_pointer {
            frame.frame_pointer = depth.checked_add_signed(-above);
        }
        match instruction.flow {
            Flow::Next => ahead.push((instruction.next, after)),
            Flow::Stop => {}
            Flow::Jump { to, always } => {
                if function.body.contains(&to) {
                    ahead.push((to, after));
                } else if image.functions.contains_key(&to) {
                    frame.calls.push(call(Target::Function(to)));
                    frame.returns |= returning.contains(&to);
                } else {
                    return Err(wrong(at, "a jump into the middle of another function"));
                }
                if !always {
                    ahead.push((instruction.next, after));
                }
            }
            Flow::Call { to } => {
                if !image.functions.contains_key(&to) {
                    return Err(wrong(at, "a call to what is no function"));
                }
                frame.calls.push(call(Target::Function(to)));
                if returning.contains(&to) {
                    ahead.push((instruction.next, after));
                }
            }
            Flow::CallRegister => {
                frame.calls.push(call(Target::Indirect));
                ahead.push((instruction.next, after));
            }
            Flow::JumpRegister { always } => {
                frame.calls.push(call(Target::Indirect));
                frame.returns = true;
                if !always {
                    ahead.push((instruction.next, after));
                }
            }
            Flow::Return { always } => {
                if after != 0 {
                    return Err(wrong(at, "a return with something left on the stack"));
                }
                frame.returns = true;
                if !always {
                    ahead.push((instruction.next, depth));
                }
            }
            Flow::Table { entry, base } => {
                let before = ahead.len();
                let place = match base {
                    None => Some(instruction.next),
                    Some(register) => loaded(code, function.body.start..at, register),
                };
                let place = place.ok_or_else(|| wrong(at, "a jump table that is nowhere"))?;
                ahead.extend(table(image, code, instruction.next, place, entry).map(|to| (to, after)));
                if ahead.len() == before {
                    return Err(wrong(at, "a jump table without entries"));
                }
            }
        }
    }
    Ok(frame)
}

/// What takes the frame off the stack and returns, or goes to another function, all under one condition: where the program
/// goes on if it does not hold, and the other function.
fn conditional_return(
    image: &Image,
    code: &BTreeMap<u32, Instruction>,
    mut at: u32,
    mut depth: u32,
) -> Option<(u32, Option<u32>)> {
    let condition = code.get(&at)?.condition;
    loop {
        let instruction = code.get(&at).filter(|instruction| instruction.condition == condition)?;
        if let Stack::Down(bytes) = instruction.stack {
            depth = depth.checked_add_signed(bytes).filter(|&after| after <= depth)?;
        }
        match (instruction.flow, instruction.stack) {
            (Flow::Return { .. }, _) => return (depth == 0).then_some((instruction.next, None)),
            (Flow::Jump { to, .. }, Stack::Same) if image.functions.contains_key(&to) => {
                return (depth == 0).then_some((instruction.next, Some(to)));
            }
            (Flow::Next, Stack::Same | Stack::Down(_)) => at = instruction.next,
            _ => return None,
        }
    }
}

/// The address that was loaded last into a register, before the end of `within`.
fn loaded(code: &BTreeMap<u32, Instruction>, within: Range<u32>, register: u16) -> Option<u32> {
    let loads = code.range(within).rev().filter_map(|(_, instruction)| instruction.nearby);
    loads.filter(|&(into, _)| into == register).map(|(_, address)| address).next()
}

/// Where the jump table at `place` leads: offsets from `start`, in halfwords. It ends where instructions begin again, and
/// among constants at an offset of zero; a byte that only fills it up leads nowhere, that is, to the table itself.
fn table(
    image: &Image,
    code: &BTreeMap<u32, Instruction>,
    start: u32,
    place: u32,
    entry: u32,
) -> impl Iterator<Item = u32> {
    let entries = (place..).step_by(entry as usize).take_while(|at| !code.contains_key(at));
    let offsets = entries.map_while(move |at| image.constant(at, entry as usize));
    let offsets = offsets.take_while(move |&offset| offset != 0 || place == start);
    let targets = offsets.map(move |offset| (start + 2 * offset) & !THUMB);
    let targets: Vec<u32> = targets.filter(|to| code.contains_key(to)).collect();
    targets.into_iter()
}
