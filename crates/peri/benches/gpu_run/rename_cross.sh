#!/bin/bash
# Renames of public items of `harness` that other crates use; run once after all branches are merged, then `cargo check`.
cd "$1" || exit 1
F=$(git ls-files 'crates/*.rs' 'python/*.rs' 'tests/*.rs' 'xtask/*.rs')
# Quantity::of(parts) -> named(parts): constants in capitals only
perl -pi -e 's/\b((?:q|quantities)::)([A-Z][A-Z0-9_]*)\.of\(/$1$2.named(/g' $F
perl -pi -e 's/\b(ERROR_OF|LIMIT|ORDER|REACTION)\.of\(/$1.named(/g; s/self\.of\(&vec/self.named(&vec/; s/quantity\.of\(&\[\]\)/quantity.named(&[])/; s/pub fn of\(&self, parts/pub fn named(&self, parts/' $(git ls-files 'crates/harness/*.rs')
# Case::bulky -> large_outputs
perl -pi -e 's/\bfn bulky\(/fn large_outputs(/; s/\bC::bulky\(/C::large_outputs(/' $F
git grep -nE '[A-Z]\.of\(&\[' -- '*.rs' | head
