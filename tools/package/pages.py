#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Writes the manual page and the shell's completions from what the program's own --help says, so
# that they tell nothing else.
# usage: tools/package/pages.py VEDUTA FOLDER
#   FOLDER/veduta.1, FOLDER/veduta.bash, FOLDER/_veduta (for zsh)
import os
import re
import subprocess
import sys

# A row of help: two spaces, what it is about, and its text in the 31st column or on the next lines.
ROW = re.compile(r'^  (?P<name>\S.*?)(?:  +(?P<text>\S.*))?$')
SECTIONS = ('Positionals:', 'Options:', 'Subcommands:')
END = '''.SH EXIT STATUS
.TP
.B 0
Done.
.TP
.B 1
Something that was asked for could not be done.
.TP
.B 2
Bad usage.
.TP
.B 3
The database is damaged, of another format, or being written to by another process.
.SH SEE ALSO
.BR systemctl (1)
and the documents in /usr/share/doc/veduta.
'''


class Command:
    """What the help of one command says: its text, usage, and rows by section."""

    def __init__(self, program, path):
        done = subprocess.run([program, *path, '--help'], capture_output=True, text=True,
                              check=True)
        self.path = path
        self.text, self.usage, self.rows = '', '', {name: [] for name in SECTIONS}
        section = None
        for line in done.stdout.splitlines():
            row = ROW.match(line)
            if line in SECTIONS:
                section = self.rows[line]
            elif line.startswith('Usage: '):
                self.usage = ' '.join(['veduta', *line.split()[2:]])
            elif section is None:
                self.text = (self.text + ' ' + line.strip()).strip()
            elif row:
                section.append([row['name'], row['text'] or ''])
            elif line.strip():
                section[-1][1] = (section[-1][1] + ' ' + line.strip()).strip()
        self.inner = [Command(program, (*path, name))
                      for name, _ in self.rows['Subcommands:']]

    def all(self):
        """It, and all commands below."""
        yield self
        for inner in self.inner:
            yield from inner.all()

    def options(self):
        """"--json" and its like."""
        names = [name.split(' ')[0] for name, _ in self.rows['Options:']]
        return [one for name in names for one in name.split(',') if one.startswith('--')]


def troff(text):
    escaped = text.replace('\\', '\\e').replace('-', '\\-')
    return '\\&' + escaped if escaped.startswith(('.', "'")) else escaped


def manual(root, version):
    lines = [f'.TH VEDUTA 1 "" "veduta {version}" "User Commands"', '.SH NAME',
             'veduta \\- ' + troff(root.text.removeprefix('Veduta: ')), '.SH SYNOPSIS',
             '.B veduta', '.I COMMAND', '\\&...', '.SH COMMANDS']
    for command in root.all():
        if not command.path or command.rows['Subcommands:']:
            continue
        lines += [f'.SS "{troff(command.usage)}"', troff(command.text)]
        for section in ('Positionals:', 'Options:'):
            for name, text in command.rows[section]:
                if not name.startswith('-h,'):
                    lines += ['.TP', f'.B {troff(name)}', troff(text)]
    return '\n'.join(lines) + '\n' + END


def completions(root):
    cases, known = [], ''
    for command in root.all():
        words = [name for name, _ in command.rows['Subcommands:']] + command.options()
        known += f"      ' {' '.join(command.path)}') ;;\n"
        cases.append(f"    '{' '.join(command.path)}') words='{' '.join(words)}' ;;\n")
    return f'''# Completions of veduta for bash.
_veduta() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" path='' words=''
  local index
  for ((index = 1; index < COMP_CWORD && index <= 2; ++index)); do
    [[ "${{COMP_WORDS[index]}}" =~ ^[a-z]+$ ]] || break
    case "${{path:+ $path}} ${{COMP_WORDS[index]}}" in
{known}      *) break ;;
    esac
    path="${{path:+$path }}${{COMP_WORDS[index]}}"
  done
  case "$path" in
{''.join(cases)}  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _veduta veduta
'''


def quoted(text):
    """As one word of zsh."""
    return "'" + text.replace("'", "'\\''") + "'"


def entry(name, text):
    """"NAME:TEXT", as _describe takes it: without the colons that part them."""
    return quoted(name.replace(':', '\\:') + ':' + text.replace(':', '\\:'))


def zsh_completions(root):
    cases = []
    for command in root.all():
        inner = ' '.join(entry(name, text) for name, text in command.rows['Subcommands:'])
        options = ' '.join(entry(one, text) for name, text in command.rows['Options:']
                           for one in name.split(' ')[0].split(',') if one.startswith('--'))
        cases.append(f"    {quoted(' '.join(command.path))}) inner=({inner}) "
                     f"options=({options}) ;;\n")
    known = '|'.join(quoted(' '.join(command.path)) for command in root.all() if command.path)
    return f'''#compdef veduta
# Completions of veduta for zsh.
_veduta() {{
  local command='' next index
  local -a inner options
  for ((index = 2; index < CURRENT && index <= 3; ++index)); do
    next="${{command:+$command }}${{words[index]}}"
    case "$next" in
      {known}) command="$next" ;;
      *) break ;;
    esac
  done
  case "$command" in
{''.join(cases)}  esac
  if (( $#inner )); then
    _describe -t commands 'command' inner
  elif [[ "$PREFIX" == -* ]]; then
    _describe -o -t options 'option' options
  else
    _files
  fi
}}
if [[ "${{funcstack[1]}}" == _veduta ]]; then
  _veduta "$@"
else
  compdef _veduta veduta
fi
'''


def main():
    program, folder = sys.argv[1:]
    root = Command(program, ())
    version = subprocess.run([program, '--version'], capture_output=True, text=True,
                             check=True).stdout.strip()
    os.makedirs(folder, exist_ok=True)
    for name, text in (('veduta.1', manual(root, version)), ('veduta.bash', completions(root)),
                       ('_veduta', zsh_completions(root))):
        with open(os.path.join(folder, name), 'w', encoding='utf-8') as file:
            file.write(text)


if __name__ == '__main__':
    main()
