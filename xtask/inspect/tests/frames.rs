//! The frame of one function.

mod common;

use common::*;

fn frame_of(body: &[u16]) -> (u32, bool) {
    let image = image(&[("main", body)], &[], &[]);
    let (_, frames) = frames(&image).expect("a function that can be followed");
    let frame = &frames[&address(0)];
    (frame.size, frame.returns)
}

fn refusal(body: &[u16]) -> String {
    frames(&image(&[("main", body)], &[], &[])).expect_err("a function that cannot be followed").to_string()
}

#[test]
fn pushed_registers_and_local_variables_add_up() {
    assert_eq!(frame_of(&[BX_LR]), (0, true));
    assert_eq!(frame_of(&[PUSH_R7_LR, POP_R7_PC]), (8, true));
    assert_eq!(frame_of(&[PUSH_R7_LR, SUB_SP_16, ADD_SP_16, POP_R7_PC]), (24, true));
    // vpush {d8, d9}; str r4, [sp, #-8]!; ldr r4, [sp], #8; vpop {d8, d9}
    let others = [0xED2D, 0x8B04, 0xF84D, 0x4D08, 0xF85D, 0x4B08, 0xECBD, 0x8B04, BX_LR];
    assert_eq!(frame_of(&others), (24, true));
}

#[test]
fn a_return_under_a_condition_leaves_the_frame_to_the_other_way() {
    let body = [PUSH_R7_LR, CMP_R0_0, IT_NE, POP_R7_PC, SUB_SP_16, ADD_SP_16, POP_R7_PC];
    assert_eq!(frame_of(&body), (24, true));
    // itt ne; addne sp, #16; popne {r7, pc}
    let body = [PUSH_R7_LR, SUB_SP_16, CMP_R0_0, 0xBF1C, ADD_SP_16, POP_R7_PC, ADD_SP_16, POP_R7_PC];
    assert_eq!(frame_of(&body), (24, true));
}

#[test]
fn a_loop_does_not_return() {
    assert_eq!(frame_of(&[PUSH_R7_LR, 0xE7FE]), (8, false));
}

#[test]
fn what_is_behind_a_call_without_return_does_not_count() {
    let caller = [&[PUSH_R7_LR][..], &bl((0, 1), 1), &[SUB_SP_16, BX_LR]].concat();
    let image = image(&[("main", &caller), ("stop", &[0xE7FE])], &[], &[]);
    let (_, frames) = frames(&image).expect("functions that can be followed");
    assert_eq!((frames[&address(0)].size, frames[&address(0)].returns), (8, false));
}

#[test]
fn both_ways_of_a_jump_table_are_followed() {
    let mut image = image(&[("main", &[])], &[], &[]);
    let start = address(0);
    // The table's entries are halfwords from its beginning: 1 and 2.
    let code: Vec<u8> = TBB_R0.iter().flat_map(|half| half.to_le_bytes()).collect();
    let places: Vec<u8> = [BX_LR, PUSH_R7_LR, POP_R7_PC].iter().flat_map(|half| half.to_le_bytes()).collect();
    image.functions.get_mut(&start).expect("main").body = start..start + 12;
    image.code = [(start, code), (start + 6, places)]
        .map(|(address, bytes)| clino_inspect::elf::Bytes { address, bytes })
        .to_vec();
    image.data.push(clino_inspect::elf::Bytes { address: start + 4, bytes: vec![1, 2] });
    let (_, frames) = frames(&image).expect("a function that can be followed");
    assert_eq!(frames[&start].size, 8);
    assert!(frames[&start].depths.contains_key(&(start + 6)), "the first entry");
}

#[test]
fn what_cannot_be_followed_is_refused() {
    assert!(refusal(&[&SUB_SP_R4[..], &[BX_LR]].concat()).contains("unknown amount"));
    assert!(refusal(&[PUSH_R7_LR, MOV_SP_R1, BX_LR]).contains("unknown amount"));
    assert!(refusal(&[PUSH_R7_LR, BX_LR]).contains("left on the stack"));
    assert!(refusal(&[POP_R7_PC]).contains("more is taken off"));
    // cbz r0 over the push.
    assert!(refusal(&[0xB100, PUSH_R7_LR, POP_R7_PC]).contains("different depths"));
}
