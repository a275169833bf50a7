"""Prints the answers of mystery robots: python3 PATH/mystery_key.py FIRST LAST"""
import one_line_errors    # noqa: F401 (it changes how Python reports the errors below)

from tb3_labs.command_line import Parser
from tb3_labs.simulation.mystery_robot import fault_of

parser = Parser(prog='mystery_key.py', description=__doc__)
parser.add_argument('first', metavar='FIRST', type=int)
parser.add_argument('last', metavar='LAST', type=int)
words = parser.parse_args()
if words.first > words.last:
    parser.error(f'FIRST = {words.first} is greater than LAST = {words.last}')
answers = [(number, *fault_of(number)) for number in range(words.first, words.last + 1)]
print('number  fault            value')
for number, fault, value, _ in answers:
    print(f'{number:6}  {fault.name:15}  {fault.text(value)} (within {fault.tolerance:g})')
