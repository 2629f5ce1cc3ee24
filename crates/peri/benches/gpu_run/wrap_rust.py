#!/usr/bin/env python3
"""wrap.py FILE...: wraps comments and string literals of Rust files at 110 characters."""
import re,sys,textwrap
W=110
def wrap_comments(lines):
    out=[];i=0
    while i<len(lines):
        m=re.match(r'^(\s*)(//[/!]?)( .*)?$',lines[i])
        if not m: out.append(lines[i]);i+=1;continue
        ind,mark=m.group(1),m.group(2)
        blk=[]
        while i<len(lines):
            n=re.match(r'^(\s*)(//[/!]?)( .*)?$',lines[i])
            if not n or n.group(1)!=ind or n.group(2)!=mark: break
            blk.append((n.group(3) or '')[1:]);i+=1
        out+=[(ind+mark+(' '+t if t else '')).rstrip() for t in wrap_block(blk,W-len(ind)-len(mark)-1)]
    return out
def wrap_block(blk,width):
    res=[];para=[];fence=False
    def flush():
        nonlocal para
        if para:
            if any(len(x)>width for x in para):
                ind=re.match(r'^(\s*(?:[-*] |\d+\. )?)',para[0]).group(1)
                txt=' '.join(x.strip() for x in para)
                res.extend(textwrap.wrap(txt,width,initial_indent=re.match(r'^\s*',para[0]).group(0),subsequent_indent=' '*len(ind),break_long_words=False,break_on_hyphens=False))
            else: res.extend(para)
            para=[]
    for t in blk:
        if t.strip().startswith('```'):
            flush();fence=not fence;res.append(t);continue
        if fence or not t.strip() or t.lstrip().startswith(('#','|')) or t.startswith('    '):
            flush();res.append(t);continue
        if re.match(r'^\s*([-*] |\d+\. )',t): flush()
        para.append(t)
    flush()
    return res
def lex(lines):
    """for each line: in_string_at_start ('' none, '"' plain, 'r##' raw)"""
    states=[];st=''
    for l in lines:
        states.append(st)
        j=0
        while j<len(l):
            c=l[j]
            if st=='':
                if l.startswith('//',j): break
                m=re.match(r'b?r(#*)"',l[j:])
                if m and (j==0 or not (l[j-1].isalnum() or l[j-1]=='_')): st='r'+m.group(1);j+=m.end();continue
                if c=='"': st='"';j+=1;continue
                if c=="'":
                    m=re.match(r"'(\\.[^']*|[^\\'])'",l[j:])
                    if m: j+=m.end();continue
                j+=1
            elif st=='"':
                if c=='\\': j+=2;continue
                if c=='"': st=''
                j+=1
            else:
                end='"'+st[1:]
                if l.startswith(end,j): st='';j+=len(end)
                else: j+=1
    return states
def wrap_strings(lines):
    changed=True
    guard=0
    while changed and guard<2000:
        changed=False;guard+=1
        states=lex(lines)
        for n,l in enumerate(lines):
            if len(l)<=W: continue
            st=states[n]
            if st.startswith('r'): continue
            # find break candidates: spaces inside plain strings
            cand=[];start=None;cur=st;j=0
            curstart=(len(l)-len(l.lstrip())) if st=='"' else None
            while j<len(l):
                c=l[j]
                if cur=='':
                    if l.startswith('//',j): break
                    m=re.match(r'b?r(#*)"',l[j:])
                    if m and (j==0 or not (l[j-1].isalnum() or l[j-1]=='_')):
                        e='"'+m.group(1);k=l.find(e,j+m.end())
                        if k<0: break
                        j=k+len(e);continue
                    if c=='"': cur='"';curstart=j+1;j+=1;continue
                    if c=="'":
                        m=re.match(r"'(\\.[^']*|[^\\'])'",l[j:])
                        if m: j+=m.end();continue
                    j+=1
                else:
                    if c=='\\': j+=2;continue
                    if c=='"': cur='';j+=1;continue
                    if c==' ' and j+1<len(l) and l[j+1] not in ' "' and l[j-1]!=' ' : cand.append((j,curstart))
                    j+=1
            cand=[(j,s) for j,s in cand if j<=W-2 and j>s+8 and '{' not in l[s:j].rsplit('}',1)[-1].replace('{{','')]
            if not cand: continue
            j,s=cand[-1]
            base=l[:len(l)-len(l.lstrip())]
            if st=='"' and s==len(base): indent=base
            elif l.lstrip().startswith('"'): indent=base+' '
            else: indent=base+'    '
            lines[n:n+1]=[l[:j+1]+'\\',indent+l[j+1:]]
            changed=True
            break
    return lines
for f in sys.argv[1:]:
    o=open(f).read()
    lines=o.split('\n')
    st=lex(lines)
    # wrap comments only outside of strings
    if any(st):
        segs=[];cur=[];inside=False
        for l,s in zip(lines,st):
            if bool(s)!=inside:
                segs.append((inside,cur));cur=[];inside=bool(s)
            cur.append(l)
        segs.append((inside,cur))
        lines=[]
        for ins,seg in segs: lines+=seg if ins else wrap_comments(seg)
    else: lines=wrap_comments(lines)
    lines=wrap_strings(lines)
    s='\n'.join(lines)
    if s!=o: open(f,'w').write(s)
