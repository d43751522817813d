#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# Goal: no function has more than 60 lines, from the first of its signature to its closing brace.
# Method: a walk over the braces of each C++ and OpenCL file; Python's own parser for scripts.
#   Before that, made-up sources with functions of known lengths are measured.
# usage: tests/tidy/functions_test.py [ROOT]
import ast
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..'))
import tidy_test  # noqa: E402 (the line above finds it)

FUNCTION_LINES_MAX = 60  # chosen by hand in the issue "A house to live in"; the median has 7 lines
SKIPPED = re.compile(  # what holds braces that are none: comments, raw strings, strings, characters
    r'//[^\n]*|/\*.*?\*/|R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"'
    r"|(?<![0-9a-fA-F])'(?:\\.|[^'\\\n])+'|^[ \t]*#(?:\\\n|[^\n])*", re.DOTALL | re.MULTILINE)
SCOPE = re.compile(r'(?:inline\s+)?namespace\b|extern\s*$|'
                   r'(?:typedef\s+)?(?:class|struct|union|enum)\b(?!.*\)\s*$)', re.DOTALL)
TEMPLATE = re.compile(r'template\s*<(?:[^<>]|<(?:[^<>]|<[^<>]*>)*>)*>(?:\s*requires\b[^{]*?\n)?')


def blank(found):
    """As many lines, nothing in them."""
    return re.sub(r'[^\n]', ' ', found[0])


def is_scope(head):
    return SCOPE.match(TEMPLATE.sub('', head).strip()) is not None


def is_function(head):
    """A list of parameters that no `=` stands before."""
    head = re.sub(r'operator\s*(\(\)|[^\s(]+)', 'operator', TEMPLATE.sub('', head))
    return '(' in head and '=' not in head.split('(')[0]


def name_of(head):
    """The function's name; of a test its suite and its own."""
    found = re.search(r'(TEST\w*\([^()]*\)|[\w:~]+)\s*(?:\(|$)', TEMPLATE.sub('', head).strip())
    return ' '.join(found[1].split()) if found else '?'


def cpp_functions(text):
    """(first line, lines, name) of each function; a lambda counts as lines of the one around it."""
    text = SKIPPED.sub(blank, text)
    stack = []  # per open brace: 'scope', 'other', or where the function began
    begin = 0  # of the statement at hand
    depth = 0  # of parentheses
    for at in (found.start() for found in re.finditer(r'[{};()]', text)):
        sign = text[at]
        depth += {'(': 1, ')': -1}.get(sign, 0)
        in_scope = all(kind == 'scope' for kind in stack)
        if sign == '{':
            head = text[begin:at]
            begins_function = in_scope and depth == 0 and is_function(head)
            starts = begin + len(head) - len(head.lstrip())
            kind = 'scope' if in_scope and depth == 0 and is_scope(head) else 'other'
            stack.append((starts, head) if begins_function and kind == 'other' else kind)
            if kind == 'scope':
                begin = at + 1
        elif sign == '}' and stack:
            kind = stack.pop()
            if isinstance(kind, tuple):
                # `: member_{value} {`: what ended was a part of the list before the body.
                if re.match(r'\s*[,{]', text[at + 1:]) and ':' in kind[1].split(')')[-1]:
                    continue
                first, last = text.count('\n', 0, kind[0]) + 1, text.count('\n', 0, at) + 1
                yield first, last - first + 1, name_of(kind[1])
            if all(kind == 'scope' for kind in stack):
                begin = at + 1
        elif sign == ';' and in_scope and depth == 0:
            begin = at + 1


def python_functions(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.lineno, node.end_lineno - node.lineno + 1, node.name


def functions(path, text):
    if path.endswith('.py'):
        return python_functions(text)
    return cpp_functions(text) if path.endswith(tidy_test.INCLUDERS) else ()


def violations(tree):
    for path in sorted(tree):
        for line, count, name in functions(path, tree[path]):
            if count > FUNCTION_LINES_MAX:
                yield f'{path}:{line}: {name} has {count} lines; {FUNCTION_LINES_MAX} at most'


BODY = '  x("}{");  // }\n' * 3
# A made-up source, and the lines of each function in it.
SAMPLES = (
    ('a.cc', f'namespace a {{\nvoid F() {{\n{BODY}}}\n}}  // namespace\n', [5]),
    ('a.cc', f'template <class T = A<B>>\nT A<T>::F(int a,\n        int b) const {{\n{BODY}}}\n',
     [7]),
    ('a.cc', f'struct A {{\n  int x = 1;\n  A() : a_{{1}}, b_(2) {{\n{BODY}  }}\n  int y;\n}};\n',
     [5]),
    ('a.cc', f'int a[] = {{1, 2}};\nauto f = G(H{{3}});\nTEST(A, B) {{\n{BODY}}}\n', [5]),
    ('a.cc', f'void F() {{\n  G([&] {{\n{BODY}  }});\n}}\nstruct A F(struct B b) {{\n{BODY}}}\n',
     [7, 5]),
    ('a.h', f'#define M(x) {{ \\\n  x\nbool operator==(A a, A b) {{\n{BODY}}}\n', [5]),
    ('a.cc', f'R"x({{)x";\nbool A::operator()() {{\n{BODY}}}\nint d = 1\'000;\n', [5]),
    ('a.cc', f'using F = int;\nextern "C" {{\nvoid F() {{\n{BODY}}}\n}}\n', [5]),
    ('a.cl', f'__kernel void f(__global const uchar* a,\n    int b) {{\n{BODY}}}\n', [6]),
    ('a.py',
     'def f():\n    pass\n\n\nclass A:\n    def g(self):\n        x = 1\n        return x\n',
     [2, 3]),
)


def self_test():
    wrong = []
    for path, text, expected in SAMPLES:
        measured = [count for _, count, _ in functions(path, text)]
        if measured != expected:
            wrong.append(f'self-test: {expected} lines were to be measured, not {measured}, in\n'
                         f'{text}')
    for lines, count in ((FUNCTION_LINES_MAX, 0), (FUNCTION_LINES_MAX + 1, 1)):
        text = 'void F() {\n' + '  ;\n' * (lines - 2) + '}\n'
        if len(list(violations({'a.cc': text}))) != count:
            wrong.append(f'self-test: a function of {lines} lines')
    return wrong


def main():
    wrong = self_test()
    root = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else '.')
    if not os.path.exists(os.path.join(root, '.git')):
        print(f'{root} is no git checkout: nothing says which files are the project\'s')
        return 77  # ctest: skipped
    tree = tidy_test.read_tree(root)
    wrong += violations(tree)
    for text in wrong:
        print(text)
    measured = sum(len(list(functions(path, text))) for path, text in tree.items())
    print(f'{measured} functions measured, {len(wrong)} violations')
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
