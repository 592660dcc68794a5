#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""dap-mode of Emacs debugs a program with `robomosp debug-adapter`: breakpoint, frames, variables,
steps, output, end. Skipped where there is no Emacs with dap-mode (ROBOMOSP_EMACS names another)."""

import os
import shutil
import subprocess
import sys
import tempfile

PROGRAM = os.environ.get("ROBOMOSP_PROGRAM", "robomosp")
SOURCE = """PROGRAM lift;
VAR
  INT: rounds := 3, i, sum;
PROCEDURE add (IN INT: n);
BEGIN
  sum := sum + n;
ENDPROC;
BEGIN
  FOR i := 1 TO rounds
    add(i);
    WAIT 0.1 SEC;
  ENDFOR;
  WRITELN('sum ', sum);
ENDPROGRAM;
"""
SCRIPT = """
(require 'dap-mode)
(require 'dap-ui)
(setq dap-auto-show-output nil lsp-session-file (concat default-directory "session"))
(defun check (what is-right)
  (unless is-right (message "failed: %s" what) (kill-emacs 1)))
(defun await (what is-there)
  (let ((end (+ (float-time) 60)))
    (while (and (not (funcall is-there)) (< (float-time) end)) (accept-process-output nil 0.02))
    (check what (funcall is-there))))
(find-file "lift.irl")
(goto-char (point-min))
(forward-line 5)
(dap-breakpoint-add)
(dap-start-debugging-noexpand
 (list :type "robomosp" :request "launch" :name "lift" :program (expand-file-name "lift.irl")
       :dap-server-path (list "@PROGRAM@" "debug-adapter")))
(setq session (dap--cur-session))
(defun frame () (dap--debug-session-active-frame session))
(defun line () (and (frame) (gethash "line" (frame))))
(await "the breakpoint" (lambda () (equal (line) 6)))
(check "its file" (string-suffix-p "lift.irl" (gethash "path" (gethash "source" (frame)))))
(check "its routine" (string= (downcase (gethash "name" (frame))) "add"))
(check "where the point is" (= (line-number-at-pos) 6))
(check "a value" (string= "1" (gethash "result" (dap-request session "evaluate" :expression "n"
                                                              :frameId (gethash "id" (frame))))))
(dap-step-out session)
(await "a step out" (lambda () (equal (line) 11)))
(dap-next session)
(await "a step" (lambda () (memq (line) '(9 10))))
(dap-breakpoint-delete-all)
(dap-continue session (dap--debug-session-thread-id session))
(await "the end" (lambda () (not (dap--session-running session))))
(check "what it writes"
       (with-current-buffer (dap--debug-session-output-buffer session)
         (string-match-p "sum 6" (buffer-string))))
(message "Emacs %s has debugged a program" emacs-version)
"""


def main():
    editor = shutil.which(os.environ.get("ROBOMOSP_EMACS", "emacs"))
    probe = [editor, "-Q", "--batch", "--eval", "(progn (package-initialize) (require 'dap-mode))"]
    if not editor or subprocess.run(probe, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                    timeout=120, check=False).returncode:
        print("skipped: there is no Emacs with dap-mode")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "lift.irl"), "w", encoding="utf-8") as f:
            f.write(SOURCE)
        script = os.path.join(folder, "try.el")
        with open(script, "w", encoding="utf-8") as f:
            f.write(SCRIPT.replace("@PROGRAM@", os.path.abspath(shutil.which(PROGRAM) or PROGRAM)))
        done = subprocess.run([editor, "-Q", "--batch", "--eval", "(package-initialize)",
                               "-l", script],
                              cwd=folder, timeout=240, stdin=subprocess.DEVNULL,
                              env=dict(os.environ, HOME=folder),
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    print(done.stdout.decode("utf-8", "replace")[-3000:])
    return done.returncode


if __name__ == "__main__":
    if len(sys.argv) > 1:
        PROGRAM = sys.argv[1]
    sys.exit(main())
