#!/usr/bin/python3
"""The rules of CONTRIBUTING that a script can check: includes go downwards, functions fit on a screen, classes have few
fields, nothing names a place on one machine. Arguments: the folder of the repository."""
import ast
import functools
import re
import sys
import unittest
from pathlib import Path

import cpp_outline

outline = functools.cache(cpp_outline.outline)

root = Path(sys.argv.pop(1))

# A file may include what is in its own folder, in a row above, or in a part that its part may know.
layers = {
    'common': [{'geometry'}, {'formula'}, {'energy', 'model'}, {'solve', 'series'}, {'shapes'}, {'case'}, {'theory', 'result', 'equilibrium'}, {'run'}],
    'axisym': [{'splines'}, {'integration'}, {'graph'}, {'curve'}, {'equilibrium'}, {''}],
    'surface3d': [{'mesh'}, {'fem'}, {'curvature'}, {'meshing', 'import', 'motion'}, {'equilibrium'}, {'run'}],
    'tools': [{'auto', 'compare'}, {'run'}, {'scan'}, {'confirm'}, {'command'}, {'python'}],
}
knows = {'common': set(), 'axisym': {'common'}, 'surface3d': {'common'}, 'tools': {'common', 'axisym', 'surface3d'}}

longest_function = 60  # lines
most_fields = 15


def files(*endings):
    folders = [*layers, 'tests']
    return sorted(p for f in folders for p in (root / f).rglob('*') if p.suffix in endings)


def place(path):
    part, *rest = Path(path).parts[:-1]
    return part, '/'.join(rest[:1])


def level(part, room):
    return next((i for i, rooms in enumerate(layers[part]) if room in rooms), None)


def includes(path):
    return re.findall(r'^#include "((?:common|axisym|surface3d|tools)/[^"]+)"', path.read_text(), re.MULTILINE)


def upwards(path, included):
    """Why this file must not include that one; None if it may."""
    (part, room), (other, other_room) = place(path), place(included)
    if part != other:
        return None if other in knows[part] else f'{part} must not know {other}'
    if room == other_room:
        return None
    here, there = level(part, room), level(part, other_room)
    if here is None or there is None:
        return 'a folder that has no place among the layers'
    return None if there < here else f'{room or part} is not above {other_room or other}'


def comment_above(lines, first):
    """The comment that ends on the line above `first`, a template's head left out."""
    end = first - 2
    while end >= 0 and re.match(r'\s*template\b', lines[end]):
        end -= 1
    begin = end
    while begin >= 0 and re.match(r'\s*(?://|#)', lines[begin]):
        begin -= 1
    return '\n'.join(lines[begin + 1:end + 1])


def long_functions_of_python(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef) and node.end_lineno - node.lineno >= longest_function:
            yield node.name, node.lineno, node.end_lineno


class Structure(unittest.TestCase):
    def none_of(self, offenders):
        self.assertFalse(offenders, '\n' + '\n'.join(offenders))

    def test_includes_go_downwards(self):
        self.none_of([f'{path}: includes {included}: {why}'
                      for file in files('.cpp', '.hpp') if (path := file.relative_to(root)).parts[0] in layers
                      for included in includes(file) if (why := upwards(path, included))])

    def test_headers_make_no_circle(self):
        graph = {str(f.relative_to(root)): includes(f) for f in files('.hpp')}
        done, offenders = set(), []

        def visit(header, path):
            if header in path:
                offenders.append(' -> '.join([*path[path.index(header):], header]))
            elif header not in done:
                for included in graph.get(header, []):
                    visit(included, [*path, header])
                done.add(header)

        for header in graph:
            visit(header, [])
        self.none_of(offenders)

    def test_functions_fit_on_a_screen(self):
        offenders = []
        for file in files('.cpp', '.hpp', '.py'):
            lines = file.read_text().split('\n')
            if file.suffix == '.py':
                found = list(long_functions_of_python(file))
            else:
                found = [(i.name, i.first, i.last) for i in outline(file.read_text())
                         if i.kind == 'function' and i.last - i.first >= longest_function]
            offenders += [f'{file.relative_to(root)}:{first}: {name} has {last - first + 1} lines; split it, or begin a '
                          'sentence of its comment with "Long: "'
                          for name, first, last in found if 'Long: ' not in comment_above(lines, first)]
        self.none_of(offenders)

    def test_classes_have_few_fields(self):
        offenders = []
        for file in files('.cpp', '.hpp'):
            lines = file.read_text().split('\n')
            offenders += [f'{file.relative_to(root)}:{i.first}: {i.name} has {len(i.fields)} fields; split it, or begin a '
                          'sentence of its comment with "Many fields: "'
                          for i in outline(file.read_text())
                          if i.kind == 'class' and len(i.fields) > most_fields
                          and 'Many fields: ' not in comment_above(lines, i.first)]
        self.none_of(offenders)

    def test_loops_are_not_those_of_openmp(self):
        """They wait for each other by spinning: common/solve/parallel.hpp."""
        self.none_of([f'{file.relative_to(root)}:{n}: {line.strip()}'
                      for file in files('.cpp', '.hpp')
                      for n, line in enumerate(file.read_text().split('\n'), 1) if line.lstrip().startswith('#pragma omp')])

    def test_nothing_names_a_place_on_one_machine(self):
        place_of_one = re.compile(r'(?<![\w.])/(?:home|root|work|mnt|srv)/')
        self.none_of([f'{file.relative_to(root)}:{n}: {line.strip()}'
                      for file in files('.cpp', '.hpp', '.py', '.md', '.txt', '.cmake')
                      for n, line in enumerate(file.read_text().split('\n'), 1)
                      if place_of_one.search(line) and 'place_of_one' not in line])


class Outline(unittest.TestCase):
    """The reader of C++ finds functions and classes; otherwise the tests above would pass trivially."""

    def test_functions(self):
        text = '\n'.join(['namespace a {', 'struct B {', '    B() : x{1}, y(2) {', '        f("}");', '    }',
                          '    int x, y = 3;', '    std::map<int, int> z{{1, 2}};', '    int get() const { return x; }',
                          '};', 'template <class T>', 'auto call(T t) -> int {  // {', "    if (t == '{') { return 1; }",
                          '    return 2;', '}', '}'])
        found = {(i.kind, i.name, i.last - i.first + 1) for i in outline(text)}
        self.assertEqual(found, {('function', 'B', 3), ('function', 'get', 1), ('class', 'B', 8), ('function', 'call', 5)})
        self.assertEqual([i.fields for i in outline(text) if i.kind == 'class'], [['x', 'y', 'z']])

    def test_upwards(self):
        self.assertIsNone(upwards('axisym/curve/a.cpp', 'common/solve/b.hpp'))
        self.assertIsNone(upwards('axisym/run_profile.cpp', 'axisym/curve/b.hpp'))
        self.assertIsNotNone(upwards('axisym/curve/a.cpp', 'axisym/run_profile.hpp'))
        self.assertIsNotNone(upwards('axisym/curve/a.cpp', 'surface3d/mesh/b.hpp'))
        self.assertIsNotNone(upwards('common/case/a.cpp', 'axisym/splines/b.hpp'))


if __name__ == '__main__':
    unittest.main()
