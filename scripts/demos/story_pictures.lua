-- SPDX-License-Identifier: Apache-2.0
-- The pictures of the stories in docs/user/stories, by the blocks of code of their pages, which are run
-- as if they were typed. usage: robomosp run scripts/demos/story_pictures.lua [FOLDER [QUALITY]]
local folder, quality = arg and arg[1] or ".", arg and arg[2] or "draft"
local pages = arg[0]:match("^(.*)scripts/demos/[^/]*$") .. "docs/user/stories/"

--- A page's lines of Lua, with all files in the folder; of blocks that are not run none.
local function lines_of(name)
  local out, block = {}, nil
  for line in io.lines(pages .. name .. ".md") do
    if line:match("^```lua") then block = {}
    elseif line:match("^```") then
      if block and not (block[1] or ""):match("^%-%- not run") then
        for _, l in ipairs(block) do out[#out + 1] = l end
      end
      block = nil
    elseif block then
      local there = '%1"' .. folder:gsub("%%", "%%%%")
      line = line:gsub('(file%s*=%s*)"', there .. "/"):gsub('(:save%()"', there .. "/")
      line = line:gsub('(folder%s*=%s*)"%."', there .. '"')
      block[#block + 1] = line:gsub('quality = "draft"', 'quality = "' .. quality .. '"')
    end
  end
  return out
end

for _, name in ipairs{ "student", "researcher", "offline_programmer" } do
  document.clear()
  local input = ""
  for _, line in ipairs(lines_of(name)) do
    input = input .. line .. "\n"
    local run, fault = load("return " .. input)
    if not run then run, fault = load(input) end
    if input:find("provider%.keep") then
      input = ""  -- what load() makes has no text that a file could keep
    elseif run then
      local refused = input:find("%-%- refused")
      local is_done, trouble = pcall(run)
      assert(is_done or refused, name .. ": " .. tostring(trouble) .. "\n" .. input)
      input = ""
    else
      assert(fault:find("<eof>"), fault)
    end
  end
  assert(not input:find("%S"), name .. " ends within a statement")
  print(name)
end
