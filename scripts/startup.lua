-- SPDX-License-Identifier: Apache-2.0
-- Runs at the start of every interactive session, before ~/.config/robomosp/startup.lua.
robomosp = require "robomosp"
remote = require "remote"
