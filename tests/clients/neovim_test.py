#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Neovim's own client of language servers works with ours: faults, hover, completion, layout, new
names in its buffer. Skipped where there is no Neovim."""

import os
import shutil
import subprocess
import sys
import tempfile

PROGRAM = os.environ.get("ROBOMOSP_PROGRAM", "robomosp")
SOURCE = """PROGRAM lift;
VAR
  INT: rounds := 3, i;
BEGIN
FOR i := 1 TO ronds DO
    WAIT 0.5 SEC;
  ENDFOR;
ENDPROGRAM;
"""
SCRIPT = """
local function check(what, is_right)
  if not is_right then
    io.stderr:write("failed: " .. what .. "\\n")
    vim.cmd("cquit")
  end
end
local id = vim.lsp.start_client({ name = "robomosp", cmd = { "%s", "language-server" },
                                  root_dir = vim.fn.getcwd() })
vim.cmd("edit lift.irl")
local buf = vim.api.nvim_get_current_buf()
vim.lsp.buf_attach_client(buf, id)
local function place(line, column) vim.api.nvim_win_set_cursor(0, { line, column }) end
local function ask(method)
  local all = vim.lsp.buf_request_sync(buf, method, vim.lsp.util.make_position_params(), 20000)
  for _, one in pairs(all or {}) do return one.result end
end
local function line(n) return vim.api.nvim_buf_get_lines(buf, n - 1, n, false)[1] end
check("a fault", vim.wait(20000, function() return #vim.diagnostic.get(buf) == 1 end))
local fault = vim.diagnostic.get(buf)[1]
check("its place", fault.lnum == 4 and fault.col == 14 and fault.end_col == 19)
check("its words", fault.message == "there is no name ronds.\\nDid you mean rounds?")
place(5, 4)
check("hover", ask("textDocument/hover").contents.value:find("VAR INT: i", 1, true))
place(5, 14)
check("completion", ask("textDocument/completion").items[2].label == "rounds")
vim.api.nvim_buf_set_text(buf, 4, 14, 4, 19, { "rounds" })
check("no fault", vim.wait(20000, function() return #vim.diagnostic.get(buf) == 0 end))
vim.lsp.buf_request(buf, "textDocument/formatting",
                    { textDocument = vim.lsp.util.make_text_document_params(),
                      options = { tabSize = 2, insertSpaces = true } })
check("layout", vim.wait(20000, function() return line(5) == "  FOR i := 1 TO rounds DO" end))
place(3, 8)
vim.lsp.buf.rename("steps")
check("a new name", vim.wait(20000, function() return line(3) == "  INT: steps := 3, i;" end))
check("everywhere", line(5) == "  FOR i := 1 TO steps DO")
vim.cmd("qa!")
"""


def main():
    editor = shutil.which("nvim")
    if not editor:
        print("skipped: there is no Neovim")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "lift.irl"), "w") as f:
            f.write(SOURCE)
        script = os.path.join(folder, "try.lua")
        with open(script, "w") as f:
            f.write(SCRIPT % os.path.abspath(shutil.which(PROGRAM) or PROGRAM))
        done = subprocess.run([editor, "--headless", "-n", "-u", "NONE", "-i", "NONE",
                               "-c", "luafile " + script, "-c", "cquit"],
                              cwd=folder, timeout=120, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode:
        print(done.stdout.decode("utf-8", "replace"))
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
