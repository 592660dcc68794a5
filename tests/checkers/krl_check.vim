" SPDX-License-Identifier: Apache-2.0
" Colours files by Vim's rules for KRL and writes, for each line, FILE<tab>LINE<tab>GROUP<tab>WORD of its
" first word, and FILE<tab>LINE:COLUMN<tab>krlErrorN<tab>TEXT for each place that the rules call an error.
" Used as: KRL_OUT=found.txt vim -u NONE -N -i NONE -n -es -S krl_check.vim A.src A.dat
syntax on
let s:found = []
for s:file in argv()
  execute 'edit! ' . fnameescape(s:file)
  set filetype=krl
  setlocal syntax=krl
  syntax sync fromstart
  if !exists('b:current_syntax') || b:current_syntax !=# 'krl'
    call add(s:found, s:file . "\t0\tkrlError\tthere are no rules for KRL")
  endif
  for s:line in range(1, line('$'))
    let s:text = getline(s:line)
    let s:first = match(s:text, '\S') + 1
    if s:first > 0
      let s:word = matchstr(s:text, '^\s*\zs\%([$&]\?\w\+\|\S\)')
      call add(s:found, s:file . "\t" . s:line . "\t" . synIDattr(synID(s:line, s:first, 0), 'name') . "\t" . s:word)
    endif
    for s:column in range(1, strlen(s:text))
      let s:name = synIDattr(synID(s:line, s:column, 0), 'name')
      if s:name =~# '^krlError'
        call add(s:found, s:file . "\t" . s:line . ':' . s:column . "\t" . s:name . "\t" . s:text)
      endif
    endfor
  endfor
endfor
call writefile(s:found, $KRL_OUT)
qall!
