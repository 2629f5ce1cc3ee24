//! Machine code of the kernels: inner loops over bonds keep their sums in registers.

use std::process::Command;

/// Counts the vectors stored on the stack in each inner loop of a function (instructions with address and
/// text). An inner loop that evaluates bond laws has no jump or call, a packed division, and at least ten
/// packed multiply-adds.
fn spills(function: &[(u64, &str)]) -> Vec<usize> {
    let jump = |text: &str| text.starts_with('j') || text.starts_with("call");
    let is_law = |body: &[(u64, &str)]| {
        let count = |what: &dyn Fn(&str) -> bool| body.iter().filter(|(_, text)| what(text)).count();
        count(&|text| text.starts_with("vdivp")) > 0
            && count(&|text| text.starts_with("vfmadd") && (text.contains("pd ") || text.contains("ps ")))
                >= 10
    };
    let mut found = Vec::new();
    for (end, &(from, text)) in function.iter().enumerate() {
        let target = text.strip_prefix('j').and_then(|rest| rest.split_whitespace().nth(1));
        let Some(target) = target.and_then(|target| u64::from_str_radix(target, 16).ok()) else { continue };
        let Ok(start) = function.binary_search_by_key(&target, |&(place, _)| place) else { continue };
        if target > from {
            continue;
        }
        let body = &function[start..=end];
        if is_law(body) && !body[..end - start].iter().any(|(_, text)| jump(text)) {
            let stores = |text: &str| {
                text.starts_with("vmov")
                    && text
                        .split_once(',')
                        .is_some_and(|(from, to)| from.contains("mm") && to.contains("(%rsp"))
            };
            found.push(body.iter().filter(|(_, text)| stores(text)).count());
        }
    }
    found
}

/// No vector is stored on the stack with AVX-512. With AVX2, which has 16 registers, at most four are: the
/// components of ζ until the law is evaluated, and the smallest and the largest stretch.
#[test]
fn inner_loops_do_not_spill() {
    if !evidence::hosts::has_program("objdump") {
        return;
    }
    let program = std::env::current_exe().unwrap();
    let text =
        evidence::hosts::run(Command::new("objdump").args(["-d", "-C", "--no-show-raw-insn"]).arg(program));
    let mut functions: Vec<(&str, Vec<(u64, &str)>)> = Vec::new();
    for line in text.lines() {
        if let Some((_, name)) = line.split_once(" <").filter(|_| line.ends_with(">:")) {
            functions.push((name, Vec::new()));
        } else if let Some((place, instruction)) = line.split_once(":\t")
            && let (Some((_, body)), Ok(place)) =
                (functions.last_mut(), u64::from_str_radix(place.trim(), 16))
        {
            body.push((place, instruction));
        }
    }
    for (set, allowed) in [("pulp::x86::v4::V4::vectorize", 0), ("pulp::x86::v3::V3::vectorize", 4)] {
        let of_set = functions.iter().filter(|(name, _)| name.contains(set));
        let spilled: Vec<usize> = of_set.flat_map(|(_, body)| spills(body)).collect();
        assert!(spilled.len() >= 20, "{} loops of {set}", spilled.len());
        let most = spilled.into_iter().max().unwrap_or(0);
        evidence::at_most(
            &format!("vectors on the stack in an inner loop of {set}"),
            most as f64,
            f64::from(allowed),
        );
    }
}
