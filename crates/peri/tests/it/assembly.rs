//! What compilers make of the kernels: inner loops over bonds that keep their sums in registers.

use std::process::Command;

/// An inner loop that evaluates bond laws: no jump or call in it, a packed division, ten packed multiply-adds or more.
struct Loop {
    place: u64,
    instructions: usize,
    /// Vectors stored on the stack.
    spilled: usize,
}

/// The inner loops of bond laws among the instructions (address and text) of a function.
fn loops(function: &[(u64, &str)]) -> Vec<Loop> {
    let jump = |text: &str| text.starts_with('j') || text.starts_with("call");
    let is_law = |body: &[(u64, &str)]| {
        let count = |what: &dyn Fn(&str) -> bool| body.iter().filter(|(_, text)| what(text)).count();
        count(&|text| text.starts_with("vdivpd")) > 0
            && count(&|text| text.starts_with("vfmadd") && text.contains("pd ")) >= 10
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
            let spilled = body.iter().filter(|(_, text)| stores(text)).count();
            found.push(Loop { place: target, instructions: body.len(), spilled });
        }
    }
    found
}

/// With AVX-512 no vector goes to the stack. With AVX2, which has 16 registers, at most four do: the components of ζ until the law is
/// evaluated, the least and the largest stretch.
#[test]
#[cfg(target_arch = "x86_64")]
fn inner_loops_do_not_spill() {
    if !evidence::hosts::there("objdump") {
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
        let found: Vec<Loop> = of_set.flat_map(|(_, body)| loops(body)).collect();
        let worst = found.iter().max_by_key(|found| found.spilled).expect("loops of bond laws");
        eprintln!("{set}: {} loops, most spilled {} at {:x}", found.len(), worst.spilled, worst.place);
        assert!(found.len() >= 20, "{} loops of {set}", found.len());
        assert!(
            worst.spilled <= allowed,
            "{set}: {} of {} instructions at {:x} are spills",
            worst.spilled,
            worst.instructions,
            worst.place
        );
    }
}
