#!/usr/bin/env python3
"""words_check.py TREE [PATH-PREFIX ...]: counts of issue 41, part A; with a prefix, lists the places under it."""
import re,sys,glob,collections
D=sys.argv[1].rstrip('/'); pre=tuple(sys.argv[2:])
first=re.compile(r'^(What|Where|Of|Whether|Its|How|Those|That|These|This|They|It|Which|Who|When|As|In|By|From|With|For|At|On|To|If|So|Into|Whose|Than|Such|There|Here|Thus|Their|One|Both|None|Nothing|Everything)\b')
fw=set('of at one own told said laid lay go is be to in on as by it its for so do does has have had held holds meets look looks leap still taken part know spend may yes place round release sever slack taut'.split())
docs=collections.Counter();bad=collections.Counter();long_=collections.Counter()
fn=[];types=collections.defaultdict(list)
show=lambda r:pre and r.startswith(pre)
for f in sorted(glob.glob(D+'/**/*.rs',recursive=True)):
    r=f[len(D)+1:]
    if r.startswith('target/') or '/target/' in r: continue
    c='/'.join(r.split('/')[:2])
    prev=False;library='/tests/' not in r and not r.startswith('tests/') and '/examples/' not in r and '/benches/' not in r
    intests=False
    for i,l in enumerate(open(f),1):
        s=l.strip();isdoc=s.startswith('///') or s.startswith('//!')
        if isdoc and not prev:
            docs[c]+=1
            if first.match(s[3:].strip()):
                bad[c]+=1
                if show(r): print(f'{r}:{i}: {s}')
        prev=isdoc
        if len(l.rstrip("\n"))>110:
            long_[c]+=1
            if show(r): print(f'{r}:{i}: {len(l)-1} characters')
        if re.match(r'(pub(\([^)]*\))? )?mod (tests|test)\b',s): intests=True
        m=re.match(r'pub(\([^)]*\))? (const |unsafe |async )*fn (\w+)',s)
        if m and library and not intests and (m.group(3) in fw or len(m.group(3))<=2):
            fn.append(f'{r}:{i} {m.group(3)}')
            if show(r): print(f'{r}:{i}: fn {m.group(3)}')
        m=re.match(r'(pub(\([^)]*\))? )?(struct|enum|trait|union) (\w+)|(pub(\([^)]*\))? )?type (\w+)',l)
        if m and library and not intests: types[m.group(4) or m.group(7)].append(r)
sh={k:v for k,v in types.items() if len(v)>1}
for k,v in sorted(sh.items()):
    if any(show(r) for r in v): print(f'shared type {k}: '+' '.join(v))
d,b=sum(docs.values()),sum(bad.values())
print(f'doc blocks {d}, pronoun-first {b} ({100*b/d:.2f} %); functions {len(fn)}; lines over 110: {sum(long_.values())}; shared type names {len(sh)}')
for c in docs: print(f'  {c}: {bad[c]} of {docs[c]}, long {long_[c]}')
