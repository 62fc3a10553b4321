!> Parameters of a deck, the arithmetic of *PARAMETER lines, and the replacement of
!! `<expression>` in the lines of a deck.
!!
!! Recursive descent: sum of products of powers; `**` binds to the right and before a sign.
module expression
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: read_real, to_text, lower_case, nearest_name, strings, upper_case
  use name_table, only: name_table_t, insert, place_of
  implicit none
  private

  public :: evaluate, substitute, parameter_table_t, parameter_t, find_parameter, &
            define_parameter, nearest_parameter

  !> A number or, for what the deck wrote in quotes, a text.
  type :: parameter_t
    logical :: is_text = .false.
    real(wp) :: number = 0.0_wp
    character(:), allocatable :: words   !! the text, or the number as text
    character(:), allocatable :: name    !! as the deck spells it
    integer :: block = 0                 !! number of the keyword that defines it
    integer :: line = 0                  !! of the deck itself, 0: of an included file
  end type parameter_t

  !> All parameters so far, in the order of their definition. Case does not matter.
  type :: parameter_table_t
    type(name_table_t) :: names
    type(parameter_t), allocatable :: items(:)   !! longer than the number of names
  end type parameter_table_t

  character(5), parameter :: functions(12) = [character(5) :: "sqrt", "sin", "cos", "tan", "exp", &
                                              "log", "abs", "floor", "ceil", "round", "min", "max"]
  integer, parameter :: deepest = 100   ! brackets within brackets
  integer, parameter :: most_digits = 200   ! of a number, with all that belongs to it

  !> A text being read from left to right; an allocated message stops everything.
  type :: reader_t
    character(:), allocatable :: line
    integer :: place = 1
    integer :: depth = 0
    character(:), allocatable :: message
  end type reader_t

contains

  !> Place of a parameter in `items`, 0 if there is none of that name.
  pure integer function find_parameter(table, name)
    type(parameter_table_t), intent(in) :: table
    character(*), intent(in) :: name

    find_parameter = place_of(table%names, upper_case(name))
  end function find_parameter

  !> Enter a parameter; one that is there already keeps its value and `is_new` is false.
  pure subroutine define_parameter(table, name, parameter, is_new)
    type(parameter_table_t), intent(inout) :: table
    character(*), intent(in) :: name
    type(parameter_t), intent(in) :: parameter
    logical, intent(out) :: is_new
    type(parameter_t), allocatable :: longer(:)
    integer :: n

    call insert(table%names, upper_case(name), is_new)
    if (.not. is_new) return
    n = table%names%n_names
    if (.not. allocated(table%items)) allocate (table%items(16))
    if (n > size(table%items)) then
      allocate (longer(2*n))
      longer(:n - 1) = table%items(:n - 1)
      call move_alloc(longer, table%items)
    end if
    table%items(n) = parameter
    table%items(n)%name = name
    if (.not. parameter%is_text) table%items(n)%words = to_text(parameter%number)
  end subroutine define_parameter

  !> A parameter named much like `name`, empty where there is none.
  pure function nearest_parameter(table, name) result(nearest)
    type(parameter_table_t), intent(in) :: table
    character(*), intent(in) :: name
    character(:), allocatable :: nearest

    nearest = ""
    if (table%names%n_names == 0) return
    nearest = nearest_name(name, table%names%names(:table%names%n_names))
  end function nearest_parameter

  !> Value of an expression of numbers, parameters, + - * / ** ( ), pi and functions.
  !! Fails with what was found and what was expected on anything else or a value not finite.
  pure subroutine evaluate(line, parameters, value, error)
    character(*), intent(in) :: line
    type(parameter_table_t), intent(in) :: parameters
    real(wp), intent(out) :: value
    type(error_t), allocatable, intent(out) :: error
    type(reader_t) :: reader

    reader%line = trim(line)
    call read_sum(reader, parameters, value)
    if (.not. allocated(reader%message)) then
      if (next(reader) /= "") then
        reader%message = "`"//reader%line(reader%place:)//"` where an operator was expected"
      else if (.not. ieee_is_finite(value)) then
        reader%message = "a value that is no finite number"
      end if
    end if
    if (allocated(reader%message)) then
      value = 0.0_wp
      call fail(error, reader%message)
    end if
  end subroutine evaluate

  !> Replace every `<expression>` of a line by its value; a `<` without `>` stays as it is.
  !! What cannot be evaluated becomes 1, so that one error does not bring others along. A line that
  !! grows beyond `longest` is left as it is then.
  pure subroutine substitute(line, parameters, longest, error)
    character(:), allocatable, intent(inout) :: line
    type(parameter_table_t), intent(in) :: parameters
    integer, intent(in) :: longest     !! characters
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: trouble
    character(:), allocatable :: done, inside, words
    integer :: first, last

    done = ""
    first = index(line, "<")
    do while (first > 0 .and. len(done) + len(line) <= longest)
      last = first + index(line(first + 1:), ">")
      if (last == first) exit
      inside = trim(adjustl(line(first + 1:last - 1)))
      call value_in_words(inside, parameters, words, trouble)
      if (allocated(trouble) .and. .not. allocated(error)) then
        call fail(error, "<"//inside//">: "//trouble%message)
      end if
      done = done//line(:first - 1)//words
      line = line(last + 1:)
      first = index(line, "<")
    end do
    line = done//line
  end subroutine substitute

  pure subroutine value_in_words(inside, parameters, words, error)
    character(*), intent(in) :: inside
    type(parameter_table_t), intent(in) :: parameters
    character(:), allocatable, intent(out) :: words
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: value
    integer :: place

    place = find_parameter(parameters, inside)
    if (place > 0) then
      words = parameters%items(place)%words
      return
    end if
    call evaluate(inside, parameters, value, error)
    words = to_text(value)
    if (allocated(error)) words = "1"
  end subroutine value_in_words

  !> Next character that is not blank, without moving past it; empty at the end or after an error.
  pure function next(reader) result(character_ahead)
    type(reader_t), intent(in) :: reader
    character(:), allocatable :: character_ahead
    integer :: i

    character_ahead = ""
    i = verify(reader%line(reader%place:), " ")
    if (i == 0 .or. allocated(reader%message)) return
    character_ahead = reader%line(reader%place + i - 1:reader%place + i - 1)
  end function next

  !> Move past one of these symbols if it comes next, and say which; 0: none.
  pure subroutine accept(reader, symbols, which)
    type(reader_t), intent(inout) :: reader
    character(*), intent(in) :: symbols(:)   !! of one length
    integer, intent(out) :: which
    integer :: first, last

    which = 0
    if (allocated(reader%message) .or. reader%place > len(reader%line)) return
    first = reader%place + verify(reader%line(reader%place:), " ") - 1
    last = min(first + len(symbols), len(reader%line) + 1) - 1
    do which = size(symbols), 1, -1
      if (reader%line(first:last) == symbols(which)) exit
    end do
    if (which > 0) reader%place = last + 1
  end subroutine accept

  pure recursive subroutine read_sum(reader, parameters, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    real(wp), intent(out) :: value
    real(wp) :: term
    integer :: which

    call read_product(reader, parameters, value)
    do
      call accept(reader, ["+", "-"], which)
      if (which == 0) exit
      call read_product(reader, parameters, term)
      value = value + merge(term, -term, which == 1)
    end do
  end subroutine read_sum

  pure recursive subroutine read_product(reader, parameters, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    real(wp), intent(out) :: value
    real(wp) :: factor
    integer :: which

    call read_signed(reader, parameters, value)
    do
      call accept(reader, ["*", "/"], which)
      if (which == 0) exit
      call read_signed(reader, parameters, factor)
      if (allocated(reader%message)) exit
      if (which == 1) then
        value = value*factor
      else if (abs(factor) > 0.0_wp) then
        value = value/factor
      else
        reader%message = "a division by zero"
      end if
    end do
  end subroutine read_product

  pure recursive subroutine read_signed(reader, parameters, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    real(wp), intent(out) :: value
    integer :: which

    value = 0.0_wp
    reader%depth = reader%depth + 1
    if (reader%depth > deepest .and. .not. allocated(reader%message)) then
      reader%message = "more than "//to_text(deepest)//" brackets or signs within each other"
    end if
    call accept(reader, ["+", "-"], which)
    if (which > 0) then
      call read_signed(reader, parameters, value)
      if (which == 2) value = -value
    else if (.not. allocated(reader%message)) then
      call read_power(reader, parameters, value)
    end if
    reader%depth = reader%depth - 1
  end subroutine read_signed

  pure recursive subroutine read_power(reader, parameters, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    real(wp), intent(out) :: value
    real(wp) :: exponent
    integer :: which

    call read_operand(reader, parameters, value)
    call accept(reader, ["**"], which)
    if (which == 0) return
    call read_signed(reader, parameters, exponent)
    if (allocated(reader%message)) return
    if (value < 0.0_wp .and. abs(exponent - anint(exponent)) > 0.0_wp) then
      reader%message = "a broken power of a negative number"
    else if (abs(value) <= 0.0_wp .and. exponent < 0.0_wp) then
      reader%message = "a negative power of zero"
    else if (value < 0.0_wp) then
      value = abs(value)**exponent*merge(1, -1, modulo(anint(exponent), 2.0_wp) < 0.5_wp)
    else
      value = value**exponent
    end if
  end subroutine read_power

  !> A number, a bracket, a parameter or a function with its arguments.
  pure recursive subroutine read_operand(reader, parameters, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    real(wp), intent(out) :: value
    character(:), allocatable :: ahead, word
    integer :: which

    value = 0.0_wp
    ahead = next(reader)
    if (allocated(reader%message)) return
    if (ahead == "") then
      reader%message = "nothing where a number or a parameter was expected"
    else if (scan(ahead, "0123456789.") == 1) then
      call read_literal(reader, value)
    else if (ahead == "(") then
      call accept(reader, ["("], which)
      call read_sum(reader, parameters, value)
      call accept(reader, [")"], which)
      if (which == 0 .and. .not. allocated(reader%message)) reader%message = "no closing bracket"
    else
      call read_word(reader, word)
      if (next(reader) == "(") then
        call read_function(reader, parameters, word, value)
      else if (word /= "") then
        call look_up(reader, parameters, word, value)
      else
        reader%message = "`"//ahead//"` where a number or a parameter was expected"
      end if
    end if
  end subroutine read_operand

  !> A number without sign; an e or d belongs to it only with an exponent behind.
  pure subroutine read_literal(reader, value)
    type(reader_t), intent(inout) :: reader
    real(wp), intent(out) :: value
    integer :: first, last, longest
    logical :: is_number

    first = reader%place + verify(reader%line(reader%place:), " ") - 1
    longest = last_of_number(reader%line(:min(len(reader%line), first + most_digits)), first)
    do last = longest, first, -1
      call read_real(reader%line(first:last), value, is_number)
      if (is_number) exit
    end do
    if (is_number .and. last_of(reader%line, last + 1, "0123456789") > last) then
      reader%message = "`"//reader%line(first:longest)//"`, a number that is too large"
    else if (is_number) then
      reader%place = last + 1
    else
      reader%message = "`"//reader%line(first:longest)//"` where a number was expected"
    end if
  end subroutine read_literal

  !> Place of the last character from `first` on that may belong to a number.
  pure integer function last_of_number(line, first) result(last)
    character(*), intent(in) :: line
    integer, intent(in) :: first

    last = last_of(line, first, "0123456789.")
    if (last == len(line)) return
    if (scan(line(last + 1:last + 1), "eEdD") == 0) return
    last = last + 1
    if (last < len(line)) last = last + min(1, scan(line(last + 1:last + 1), "+-"))
    last = last_of(line, last + 1, "0123456789")
  end function last_of_number

  !> Place of the last of the characters from `first` on that are in a set; first - 1 if none is.
  pure integer function last_of(line, first, set) result(last)
    character(*), intent(in) :: line, set
    integer, intent(in) :: first

    last = verify(line(first:), set)
    last = merge(len(line), first + last - 2, last == 0)
  end function last_of

  pure subroutine read_word(reader, word)
    type(reader_t), intent(inout) :: reader
    character(:), allocatable, intent(out) :: word
    character(*), parameter :: letters = &
                               "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789"
    integer :: first, last

    first = reader%place + verify(reader%line(reader%place:), " ") - 1
    last = last_of(reader%line, first, letters)
    word = reader%line(first:last)
    reader%place = last + 1
  end subroutine read_word

  pure subroutine look_up(reader, parameters, word, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    character(*), intent(in) :: word
    real(wp), intent(out) :: value
    character(:), allocatable :: nearest
    integer :: place

    value = 0.0_wp
    place = find_parameter(parameters, word)
    if (lower_case(word) == "pi") then
      value = acos(-1.0_wp)
    else if (place == 0) then
      reader%message = "no parameter `"//word//"` has been defined before"
      nearest = nearest_parameter(parameters, word)
      if (nearest /= "") reader%message = reader%message//", did you mean `"// &
                                          lower_case(nearest)//"`?"
    else if (parameters%items(place)%is_text) then
      reader%message = "the parameter `"//word//"` is a text, not a number"
    else
      value = parameters%items(place)%number
    end if
  end subroutine look_up

  pure recursive subroutine read_function(reader, parameters, word, value)
    type(reader_t), intent(inout) :: reader
    type(parameter_table_t), intent(in) :: parameters
    character(*), intent(in) :: word
    real(wp), intent(out) :: value
    real(wp) :: other
    integer :: which
    character(:), allocatable :: name, nearest

    name = lower_case(word)
    value = 0.0_wp
    if (.not. any(functions == name)) then
      reader%message = "`"//word//"` is no function"
      nearest = nearest_name(name, strings(functions))
      if (nearest /= "") reader%message = reader%message//", did you mean `"//nearest//"`?"
      return
    end if
    call accept(reader, ["("], which)
    call read_sum(reader, parameters, value)
    if (name == "min" .or. name == "max") then
      do
        call accept(reader, [","], which)
        if (which == 0) exit
        call read_sum(reader, parameters, other)
        if (name == "min") value = min(value, other)
        if (name == "max") value = max(value, other)
      end do
    end if
    call accept(reader, [")"], which)
    if (allocated(reader%message)) return
    if (which > 0) then
      call apply(name, value, reader%message)
    else
      reader%message = "no closing bracket after the argument of "//name
    end if
  end subroutine read_function

  pure subroutine apply(name, value, message)
    character(*), intent(in) :: name
    real(wp), intent(inout) :: value
    character(:), allocatable, intent(inout) :: message   !! allocated if there is no such value

    select case (name)
    case ("sqrt")
      if (value < 0.0_wp) message = "the square root of a negative number"
      value = sqrt(max(value, 0.0_wp))
    case ("log")
      if (value <= 0.0_wp) message = "the logarithm of a number that is not positive"
      value = log(max(value, tiny(value)))
    case ("sin"); value = sin(value)
    case ("cos"); value = cos(value)
    case ("tan"); value = tan(value)
    case ("exp"); value = exp(value)
    case ("abs"); value = abs(value)
    case ("floor"); value = aint(value) - merge(1.0_wp, 0.0_wp, aint(value) > value)
    case ("ceil"); value = aint(value) + merge(1.0_wp, 0.0_wp, aint(value) < value)
    case ("round"); value = anint(value)
    end select
  end subroutine apply

end module expression
