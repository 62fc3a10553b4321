!> *MATERIAL TEST: tests of one material point.
module test_keywords
  use kinds, only: wp
  use input_errors, only: error_list_t, add_error
  use text, only: string_t, strings, to_text, squeezed, joined
  use name_table, only: name_table_t
  use scene, only: scene_t, material_test_spec_t
  use lexer, only: split_fields, field_text
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, option_real, &
                          option_integer, is_option_given, line_origin, field_real, field_integer, &
                          enter_name, deck_context_t, resolve_option
  implicit none
  private

  public :: read_tests

contains

  !> Fill the list of tests, one for each *MATERIAL TEST in the order of the deck.
  subroutine read_tests(deck, context, scene, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(deck_context_t), intent(inout) :: context
    type(scene_t), intent(inout) :: scene
    type(error_list_t), intent(inout) :: errors
    type(name_table_t) :: own
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, "MATERIAL TEST")
    allocate (scene%tests(size(found)))
    do i = 1, size(found)
      associate (record => deck%records(found(i)), test => scene%tests(i))
        call enter_name(record, own, errors)
        test%origin = record%origin
        test%name = squeezed(option_text(record, "NAME"))
        test%kind = option_text(record, "TYPE")
        call check_name(test, errors)
        call resolve_option(record, "MATERIAL", context%names%materials, "*MATERIAL", &
                            test%material, errors)
        if (record%is_valid) call read_test(deck, record, test, errors)
      end associate
    end do
  end subroutine read_tests

  !> The name is that of a group in the results and part of the name of a file.
  subroutine check_name(test, errors)
    type(material_test_spec_t), intent(in) :: test
    type(error_list_t), intent(inout) :: errors
    character(*), parameter :: letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"

    if (verify(test%name, letters//"0123456789 -_") > 0) then
      call add_error(errors, test%origin, "the name "//test%name, &
                     "a name of letters, digits, blanks, - and _")
    end if
  end subroutine check_name

  subroutine read_test(deck, record, test, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_test_spec_t), intent(inout) :: test
    type(error_list_t), intent(inout) :: errors

    test%angle = option_real(record, "ANGLE")
    test%n_increments = option_integer(record, "INCREMENTS")
    test%rate = option_real(record, "RATE")
    test%is_plane = option_text(record, "STRESS STATE") == "PLANE STRESS"
    test%is_plane = test%is_plane .or. any(test%kind == ["FORMING LIMIT", "LIMIT STRESS "])
    if (test%is_plane .and. test%kind == "COMPRESSION") &
      call add_error(errors, record%origin, "STRESS STATE=PLANE STRESS with TYPE=COMPRESSION, "// &
                     "which needs a stress 33", "STRESS STATE=THREE DIMENSIONAL")
    if (is_option_given(record, "STRESS") .and. test%kind /= "PATH") then
      call add_error(errors, record%origin, "STRESS with TYPE="//test%kind, &
                     "STRESS with TYPE=PATH alone")
    end if
    select case (test%kind)
    case ("PATH")
      call read_path(deck, record, test, errors)
      call read_components(option_text(record, "STRESS"), test, errors)
      if (test%is_plane) call check_plane_path(deck, record, test, errors)
    case ("YIELD LOCUS")
      test%n_repeats = field_integer(record, 1, 1)
      test%threshold = field_real(record, 1, 2)
    case ("FORMING LIMIT")
      test%groove = field_real(record, 1, 1)
      test%n_repeats = field_integer(record, 1, 2)
      test%step = field_real(record, 1, 3)
    case ("LIMIT STRESS")
      call read_limits(deck, record, test, errors)
    case default
      test%strain = field_real(record, 1, 1)
      if (test%kind == "CYCLIC" .or. test%kind == "R VALUES") then
        test%n_repeats = field_integer(record, 1, 2)
      end if
      if (abs(test%strain) <= 0.0_wp .or. abs(test%strain) > 10.0_wp) then
        call add_error(errors, line_origin(deck, record, 1), "the strain "// &
                       to_text(test%strain), "a strain from -10 to 10 other than 0")
      end if
    end select
  end subroutine read_test

  !> Limit strains, a path of its own to each.
  subroutine read_limits(deck, record, test, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_test_spec_t), intent(inout) :: test
    type(error_list_t), intent(inout) :: errors
    integer :: line

    allocate (test%limits(2, record%n_lines))
    do line = 1, record%n_lines
      associate (limit => test%limits(:, line))
        limit = [field_real(record, line, 1), field_real(record, line, 2)]
        if (abs(limit(1)) > limit(2)) &
          call add_error(errors, line_origin(deck, record, line), "the minor strain "// &
                         to_text(limit(1))//" with the major strain "//to_text(limit(2)), &
                         "minor strains between minus the major one and the major one")
      end associate
    end do
  end subroutine read_limits

  subroutine read_path(deck, record, test, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_test_spec_t), intent(inout) :: test
    type(error_list_t), intent(inout) :: errors
    integer :: line, i

    allocate (test%path(7, record%n_lines))
    do line = 1, record%n_lines
      test%path(:, line) = [(field_real(record, line, i), i=1, 7)]
      if (line == 1) cycle
      if (test%path(1, line) > test%path(1, line - 1)) cycle
      call add_error(errors, line_origin(deck, record, line), "the time "// &
                     to_text(test%path(1, line))//" after "//to_text(test%path(1, line - 1)), &
                     "times that rise")
      exit
    end do
  end subroutine read_path

  !> In plane stress the stresses 33, 13 and 23 are zero, whether or not STRESS names them.
  subroutine check_plane_path(deck, record, test, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(material_test_spec_t), intent(inout) :: test
    type(error_list_t), intent(inout) :: errors
    integer, parameter :: through(3) = [3, 5, 6]
    character(2), parameter :: names(3) = ["33", "13", "23"]
    integer :: line, bad

    test%is_stress(through) = .true.
    do line = 1, record%n_lines
      bad = findloc(abs(test%path(1 + through, line)) > 0.0_wp, .true., 1)
      if (bad == 0) cycle
      call add_error(errors, line_origin(deck, record, line), "the value "// &
                     to_text(test%path(1 + through(bad), line))//" of "//names(bad)// &
                     " with STRESS STATE=PLANE STRESS", "0 for 33, 13 and 23, which are "// &
                     "stresses there")
    end do
  end subroutine check_plane_path

  !> Components that the path gives as stresses, from a list such as `33, 13`.
  subroutine read_components(list, test, errors)
    character(*), intent(in) :: list
    type(material_test_spec_t), intent(inout) :: test
    type(error_list_t), intent(inout) :: errors
    type(string_t), allocatable :: names(:)
    integer, allocatable :: first(:), last(:)
    character(:), allocatable :: word
    integer :: i, k

    if (list == "") return
    names = strings(["11", "22", "33", "12", "13", "23"])
    call split_fields(list, first, last)
    do i = 1, size(first)
      word = field_text(list, first(i), last(i))
      do k = size(names), 1, -1
        if (names(k)%value == word) exit
      end do
      if (k > 0) then
        test%is_stress(k) = .true.
      else
        call add_error(errors, test%origin, "`"//word//"` for STRESS", &
                       "some of "//joined(names, ", "))
      end if
    end do
  end subroutine read_components

end module test_keywords
