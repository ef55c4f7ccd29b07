//! The worst case of a whole image, and what the check has to refuse.

mod common;

use clino_inspect::frames::Frame;
use common::*;

const LEAF: &[u16] = &[PUSH_R7_LR, SUB_SP_16, ADD_SP_16, POP_R7_PC];

fn calling(from: usize, to: usize) -> Vec<u16> {
    [&[PUSH_R7_LR][..], &bl((from, 1), to), &[POP_R7_PC]].concat()
}

const INDIRECT: &[u16] = &[PUSH_R7_LR, BLX_R3, POP_R7_PC];

#[test]
fn a_chain_is_the_sum_of_its_frames() {
    let image = image(&[("main", &calling(0, 1)), ("a", &calling(1, 2)), ("b", LEAF)], &[], &[]);
    assert_eq!(bytes(&image, ""), 8 + 8 + 24);
}

#[test]
fn a_call_counts_with_what_is_on_the_stack_then() {
    // The local variables are given back before the call.
    let main = [&[PUSH_R7_LR, SUB_SP_16, ADD_SP_16][..], &bl((0, 3), 1), &[POP_R7_PC]].concat();
    assert_eq!(bytes(&image(&[("main", &main), ("a", LEAF)], &[], &[]), ""), 8 + 24);
    // A jump that ends the function leaves nothing behind: `b` to 0x100 further on.
    let jump = [0xE07E];
    assert_eq!(bytes(&image(&[("main", &jump), ("a", LEAF)], &[], &[]), ""), 24);
}

#[test]
fn an_indirect_call_reaches_what_the_table_says() {
    let image = image(&[("main", INDIRECT), ("a", LEAF), ("b", &[BX_LR])], &[1, 2], &[]);
    let table = "[[indirect]]\ncallers = [\"main\"]\ncallees = [\"a\", \"b\"]\nwhy = \"test\"\n";
    assert_eq!(bytes(&image, table), 8 + 24);
    // A jump to what is in a register is a call, too.
    let jumping = common::image(&[("main", &[BX_R3]), ("a", LEAF), ("b", &[BX_LR])], &[1, 2], &[]);
    assert_eq!(bytes(&jumping, table), 24);
}

#[test]
fn an_indirect_call_that_the_table_does_not_know_is_refused() {
    let image = image(&[("main", INDIRECT), ("a", LEAF)], &[], &[]);
    assert_eq!(refused(&image, ""), "whom does `main` call indirectly?");
}

#[test]
fn a_function_whose_address_is_taken_and_that_has_no_caller_is_refused() {
    let image = image(&[("main", INDIRECT), ("a", LEAF), ("b", LEAF)], &[1, 2], &[]);
    let table = "[[indirect]]\ncallers = [\"main\"]\ncallees = [\"a\"]\nwhy = \"test\"\n";
    assert_eq!(refused(&image, table), "who calls `b`, whose address is taken?");
}

#[test]
fn a_line_of_the_table_that_is_of_no_use_is_refused() {
    let image = image(&[("main", LEAF)], &[], &[]);
    let table = "[[indirect]]\ncallers = [\"main\"]\ncallees = [\"a\"]\nwhy = \"test\"\n";
    let refused = refused(&image, table);
    assert!(refused.contains("no code takes the address of `a`"), "{refused}");
    assert!(refused.contains("no indirect call in `main`"), "{refused}");
    let table = "[[recursion]]\nfunction = \"gone\"\nat_most = 1\nwhy = \"test\"\n";
    assert_eq!(common::refused(&image, table), "there is no function `gone`");
}

#[test]
fn recursion_needs_a_bound() {
    let image = image(&[("main", &calling(0, 1)), ("a", &calling(1, 2)), ("b", &calling(2, 1))], &[], &[]);
    // b is reached through a only, and returns through it: none of them is known to return.
    assert_eq!(refused(&image, ""), "recursion without a bound: a -> b -> a");
    let table = "[[recursion]]\nfunction = \"a\"\nat_most = 2\nwhy = \"test\"\n";
    assert_eq!(bytes(&image, table), 8 + (8 + 8) + (8 + 8));
}

const LEVELS: &str = "[[level]]\nname = \"low\"\nhandlers = [\"low\"]\n[[level]]\nname = \"high\"\nhandlers = [\"high\", \"other\"]\n";

#[test]
fn each_level_interrupts_the_one_below_once() {
    let functions: &[(&str, &[u16])] =
        &[("main", LEAF), ("low", &[PUSH_R7_LR, POP_R7_PC]), ("high", LEAF), ("other", &[BX_LR])];
    assert_eq!(bytes(&image(functions, &[], &[1, 2, 3]), LEVELS), 24 + (36 + 8) + (36 + 24));
    let unknown =
        refused(&image(functions, &[], &[1, 2, 3]), "[[level]]\nname = \"low\"\nhandlers = [\"low\"]\n");
    assert_eq!(unknown, "which level is the handler `high` of?");
    let gone = refused(&image(functions, &[], &[1, 2]), LEVELS);
    assert_eq!(gone, "no vector leads to the handler `other`");
}

#[test]
fn the_core_keeps_the_floating_point_registers_once_they_are_used() {
    // vadd.f32 s0, s0, s0, anywhere.
    let with: &[(&str, &[u16])] =
        &[("main", LEAF), ("low", &[0xEE30, 0x0A00, BX_LR]), ("high", LEAF), ("other", &[BX_LR])];
    assert_eq!(bytes(&image(with, &[], &[1, 2, 3]), LEVELS), 24 + 108 + (108 + 24));
}

#[test]
fn nothing_up_to_the_ceiling_interrupts_what_is_under_it() {
    let main = calling(0, 4);
    let functions: &[(&str, &[u16])] =
        &[("main", &main), ("low", LEAF), ("high", LEAF), ("other", &[BX_LR]), ("held", LEAF)];
    let image = image(functions, &[], &[1, 2, 3]);
    let open = bytes(&image, LEVELS);
    assert_eq!(open, (8 + 24) + 2 * (36 + 24));
    let ceiling = format!("{LEVELS}[[ceiling]]\nfunctions = [\"held\"]\nlevel = \"low\"\nwhy = \"test\"\n");
    // Either main is in `held`, and only `high` comes; or it is not, and both do.
    assert_eq!(bytes(&image, &ceiling), 8 + 2 * (36 + 24));
}

#[test]
fn a_handler_with_a_stack_of_its_own_must_fit_into_it() {
    let high = [&[MOV_SP_R1][..], LEAF].concat();
    let functions: &[(&str, &[u16])] =
        &[("main", LEAF), ("low", &[BX_LR]), ("high", &high), ("other", &[BX_LR])];
    let image = image(functions, &[], &[1, 2, 3]);
    assert_eq!(refused(&image, LEVELS), "`high` takes another stack: whose?");
    let own = |bytes: u32| {
        format!(
            "[[level]]\nname = \"low\"\nhandlers = [\"low\", \"other\"]\n[[level]]\nname = \"high\"\nhandlers = [\"high\"]\nown_stack_bytes = {bytes}\n"
        )
    };
    assert_eq!(bytes(&image, &own(24)), 24 + 36 + 36);
    assert_eq!(refused(&image, &own(23)), "`high` needs 24 bytes of its own stack, 23 are there");
}

#[test]
fn frames_of_functions_without_callers_do_not_count() {
    let image = image(&[("main", &[BX_LR]), ("alone", LEAF)], &[], &[]);
    assert_eq!(bytes(&image, ""), 0);
    let (_, frames) = frames(&image).expect("functions that can be followed");
    assert_eq!(frames[&address(1)], Frame { size: 24, ..frames[&address(1)].clone() });
}
