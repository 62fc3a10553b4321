!> Names that a deck gives to things and uses elsewhere. Case does not matter.
module deck_names
  use input_errors, only: origin_t, error_list_t, add_error
  use text, only: upper_case, to_text, squeezed
  use name_table, only: name_table_t, insert, place_of
  use field_check, only: did_you_mean
  use deck_records, only: record_t, parsed_deck_t, find_records, option_text, is_option_given
  implicit none
  private

  public :: deck_names_t, enter_names, enter_name, resolve

  !> Upper-case names; the place of a name is the place of the thing in its list of the scene.
  type :: deck_names_t
    type(name_table_t) :: materials, curves, tools, sets, probes
    type(name_table_t) :: patches   !! the blank and all tools
  end type deck_names_t

contains

  !> Enter the NAME options of all records of a keyword; a name that is there already is an error.
  subroutine enter_names(deck, keyword, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    character(*), intent(in) :: keyword
    type(name_table_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    integer, allocatable :: found(:)
    integer :: i

    found = find_records(deck, keyword)
    do i = 1, size(found)
      call enter_name(deck, deck%records(found(i)), names, errors)
    end do
  end subroutine enter_names

  !> Enter one name. A record without a new name takes a place too, under a name none can write.
  !! Names become those of groups in the result file, where slashes and lone points have a meaning.
  subroutine enter_name(deck, record, names, errors)
    type(parsed_deck_t), intent(in) :: deck
    type(record_t), intent(in) :: record
    type(name_table_t), intent(inout) :: names
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: name, given
    logical :: is_new

    given = squeezed(option_text(deck, record, "NAME"))
    name = upper_case(given)
    is_new = .false.
    if (name /= "") call insert(names, name, is_new)
    if (name /= "" .and. (scan(name, "/") > 0 .or. verify(name, ".") == 0)) then
      call add_error(errors, record%origin, "the name "//given, "a name without slashes that "// &
                     "is not made of points alone")
    end if
    if (is_new) return
    if (name /= "") call add_error(errors, record%origin, "the name "//given// &
                                   " a second time", "a name of its own")
    call insert(names, "="//to_text(names%n_names), is_new)
  end subroutine enter_name

  !> Place of the thing that goes by a name; 0 and an error if there is none.
  pure subroutine resolve(names, name, what, origin, place, errors)
    type(name_table_t), intent(in) :: names
    character(*), intent(in) :: name
    character(*), intent(in) :: what   !! such as *MATERIAL
    type(origin_t), intent(in) :: origin
    integer, intent(out) :: place
    type(error_list_t), intent(inout) :: errors
    character(:), allocatable :: hint

    place = place_of(names, squeezed(upper_case(name)))
    if (place > 0) return
    hint = ""
    if (names%n_names > 0) hint = did_you_mean(name, names%names(:names%n_names))
    call add_error(errors, origin, "the unknown name "//name, "the name of a "//what//hint)
  end subroutine resolve

end module deck_names
