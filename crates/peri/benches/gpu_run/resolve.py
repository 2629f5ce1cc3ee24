#!/usr/bin/env python3
"""Resolve diff3 conflict hunks token by token; leaves what conflicts in tokens."""
import re,sys,subprocess
from merge3 import Merge3
tok=lambda s: re.findall(r'\w+|\s+|[^\w\s]',s)
def m3(b,o,t):
    out=[];bad=False
    for g in Merge3(tok(b),tok(o),tok(t)).merge_groups():
        if g[0]=='conflict':
            _,bb,oo,tt=g
            bad=True;out.append(None)
        else: out+=g[1]
    return None if bad else ''.join(out)
files=subprocess.run(['git','diff','--name-only','--diff-filter=U'],capture_output=True,text=True).stdout.split()
for f in files:
    subprocess.run(['git','checkout','-q','--conflict=diff3','--',f])
    try: s=open(f).read()
    except FileNotFoundError: print('missing',f); continue
    left=0
    def sub(m):
        global left
        r=m3(m.group(2),m.group(1),m.group(3))
        if r is None: left+=1; return m.group(0)
        return r
    s2=re.sub(r'<<<<<<< [^\n]*\n(.*?)\|\|\|\|\|\|\| [^\n]*\n(.*?)=======\n(.*?)>>>>>>> [^\n]*\n',sub,s,flags=re.S)
    open(f,'w').write(s2)
    if left==0 and '<<<<<<<' not in s2: subprocess.run(['git','add',f])
    else: print('left',left,f)
